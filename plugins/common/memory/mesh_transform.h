// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Elements on GstBaseTransform that change a mesh and pass its views' pixels on, uncopied.
#pragma once

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/stopwatch.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/statistics.h"
#include "plugins/common/transform.h"

namespace polyhull::element {

/// generate_output: hands on a buffer with what change(mesh) makes of the queued buffer's mesh, or the
/// queued buffer itself where that returns false. Gaps pass. A buffer that is no mesh is dropped,
/// with a warning and the counter meshes-unusable.
template <class Change>
GstFlowReturn change_mesh(GstBaseTransform* base, Statistics& statistics, GstBuffer** out,
                          const Change& change) {
  *out = nullptr;
  g_autoptr(GstBuffer) queued = std::exchange(base->queued_buf, nullptr);
  if (!queued) return GST_FLOW_OK;
  return guarded(GST_ELEMENT_CAST(base), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    sync_controlled_properties(base, queued);
    if (GST_BUFFER_FLAG_IS_SET(queued, GST_BUFFER_FLAG_GAP) && gst_buffer_get_size(queued) == 0) {
      *out = gst_buffer_ref(queued);
      return GST_FLOW_OK;
    }
    std::optional<MeshBuffer> in;
    try {
      in.emplace(queued);
    } catch (const Error& error) {
      statistics.warn(GST_ELEMENT_CAST(base), "meshes-unusable",
                      fmt::format("A buffer was dropped: {}", error.what()));
      return GST_FLOW_OK;
    }
    Mesh mesh = in->mesh();
    const Stopwatch watch;
    if (!change(mesh)) {
      GST_CAT_LOG_OBJECT(category_of(base), base, "passed as it is: %" GST_PTR_FORMAT,
                         printed(queued));
      *out = gst_buffer_ref(queued);
      return GST_FLOW_OK;
    }
    GST_CAT_LOG_OBJECT(
        category_of(base), base, "%zu triangles of %zu views after %.1f ms: %" GST_PTR_FORMAT,
        mesh.hull.triangles.size() / 3, mesh.views.size(), watch.milliseconds(), printed(queued));
    std::vector<PixelSource> pixels;
    for (std::size_t k = 0; k < mesh.views.size(); ++k) pixels.push_back(in->pixels(k));
    *out = make_mesh_buffer(std::move(mesh), pixels);
    gst_buffer_copy_into(
        *out, queued,
        static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS |
                                        GST_BUFFER_COPY_META),
        0, -1);
    return GST_FLOW_OK;
  });
}

/// Pads and virtual functions of an element that does change(base, mesh) with each mesh, as
/// change_mesh() says. What it works with, a std::unique_ptr in its state, is made anew at each start.
template <class State, auto worker, auto change>
void install_mesh_transform(gpointer klass) {
  add_template(klass, "sink", GST_PAD_SINK, mesh_caps);
  add_template(klass, "src", GST_PAD_SRC, mesh_caps);
  GstBaseTransformClass* transform = GST_BASE_TRANSFORM_CLASS(klass);
  transform->generate_output = [](GstBaseTransform* base, GstBuffer** out) {
    return change_mesh(base, state_of<State>(base).statistics, out,
                       [&](Mesh& mesh) { return change(base, mesh); });
  };
  transform->start = [](GstBaseTransform* base) {
    return guarded(GST_ELEMENT_CAST(base), gboolean{FALSE}, [&]() -> gboolean {
      State& self = state_of<State>(base);
      self.statistics.reset();
      using Worker = typename std::remove_reference_t<decltype(self.*worker)>::element_type;
      self.*worker = std::make_unique<Worker>();
      return TRUE;
    });
  };
  transform->stop = [](GstBaseTransform* base) -> gboolean {
    (state_of<State>(base).*worker).reset();
    return TRUE;
  };
}

/// For the constructor: every mesh that is changed gets a buffer of its own; the caps stay.
inline void set_up_mesh_transform(gpointer object) {
  gst_base_transform_set_in_place(GST_BASE_TRANSFORM(object), FALSE);
  gst_base_transform_set_passthrough(GST_BASE_TRANSFORM(object), FALSE);
}

}  // namespace polyhull::element
