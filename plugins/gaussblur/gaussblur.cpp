// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// gaussblur: blurs the matte of a frame (the alpha of RGBA, or GRAY8 as it is) with a Gaussian and
/// leaves the colours alone. It takes the noise out of a keyed matte before contours are traced. It
/// works in place, and only where the matte is neither plainly foreground nor plainly background.
#include <gst/video/gstvideofilter.h>
#include <gst/video/video.h>

#include "plugins/common/element.h"
#include "plugins/common/guard.h"
#include "plugins/common/log.h"
#include "plugins/common/memory/matte_meta.h"
#include "plugins/common/silhouette/blur_properties.h"
#include "plugins/common/transform.h"
#include "silhouette/blur/blur.h"
#include "silhouette/pixels/matte.h"
#include "silhouette/silhouette.h"

GST_DEBUG_CATEGORY_STATIC(gaussblur_debug);
#define GST_CAT_DEFAULT gaussblur_debug

namespace {

using namespace polyhull;
using namespace polyhull::element;

struct GaussBlur {
  static constexpr char type_name[] = "PolyhullGaussBlur";
  static GType base_type() { return GST_TYPE_VIDEO_FILTER; }
  static void class_init(gpointer klass);

  explicit GaussBlur(gpointer object) {
    statistics.declare({"frames", "passed-through"});
    // A frame left out here would be missing from its set.
    gst_base_transform_set_qos_enabled(GST_BASE_TRANSFORM(object), FALSE);
  }

  BlurSettings values;  // under the object lock

  Statistics statistics{"gaussblur-stats"};
  Blur blur;                // the rest belongs to the streaming thread
  bool unwritten = false;   // the frame has its matte as it was attached
  PlanePool<Matte> mattes;  // of frames without one
  PlanePool<Field> fields;
};

/// Writes what the blur changed: blocks that were and stay uniform are not touched.
void write_back(const Field& field, const Matte& before, int threshold, std::uint8_t* first,
                std::ptrdiff_t stride, int step) {
  const int blocks = blocks_across(field.width);
  for (int y = 0; y < field.height; ++y) {
    const BlockState* now = field.state_row(y);
    const BlockState* then = before.state_row(y);
    int block = 0;
    while (block < blocks) {
      if (now[block] == then[block] && now[block] != block_mixed) {
        ++block;
        continue;
      }
      const int begin = block;
      while (block < blocks && !(now[block] == then[block] && now[block] != block_mixed)) ++block;
      const int from = begin * matte_block;
      const int to = std::min(block * matte_block, field.width);
      store_field_row(field.row(y) + from, to - from, threshold, first + stride * y + from * step,
                      step);
    }
  }
}

void blur_frame(GstElement* element, const BlurSettings& values, GstVideoFrame* frame) {
  GaussBlur& self = state_of<GaussBlur>(element);
  const AlphaView alpha = alpha_of(*frame);
  self.blur.set(values);
  const MatteContent* content = attached_matte(frame->buffer, alpha, self.unwritten);
  const bool attached = content != nullptr && content->matte != nullptr;
  const auto matte = attached ? content->matte : read_matte(alpha, self.mattes);
  // Of a second blur: what the first one began with.
  const auto keyed = content != nullptr && content->keyed != nullptr ? content->keyed : matte;
  const std::shared_ptr<Field> field = self.fields.take();
  self.blur.apply(*matte, *field);
  write_back(*field, *matte, values.threshold, alpha.first, alpha.stride, alpha.step);
  set_matte(frame->buffer, {nullptr, field, corrected_sigma(values, true), keyed});
  GST_LOG_OBJECT(element, "blurred by sigma %g, of %s matte: %" GST_PTR_FORMAT, values.sigma,
                 attached ? "the attached" : "its own", printed(frame->buffer));
}

GstFlowReturn transform_frame_ip(GstVideoFilter* filter, GstVideoFrame* frame) {
  GstElement* element = GST_ELEMENT_CAST(filter);
  GaussBlur& self = state_of<GaussBlur>(filter);
  return guarded(element, GST_FLOW_ERROR, [&]() -> GstFlowReturn {
    blur_frame(element, snapshot(filter, self.values), frame);
    self.statistics.count("frames");
    return GST_FLOW_OK;
  });
}

void before_transform(GstBaseTransform* base, GstBuffer* buffer) {
  GaussBlur& self = state_of<GaussBlur>(base);
  sync_controlled_properties(base, buffer);
  // Before the base class maps the frame for writing.
  self.unwritten = is_unwritten(buffer);
  const bool idle = snapshot(base, self.values).idle();
  gst_base_transform_set_passthrough(base, idle);
  if (!idle) return;
  self.statistics.count("passed-through");
  GST_LOG_OBJECT(base, "passes as sigma and threshold are 0: %" GST_PTR_FORMAT, printed(buffer));
}

gboolean start(GstBaseTransform* base) {
  state_of<GaussBlur>(base).statistics.reset();
  return TRUE;
}

gboolean stop(GstBaseTransform* base) {
  state_of<GaussBlur>(base).fields.clear();
  state_of<GaussBlur>(base).mattes.clear();
  return TRUE;
}

void GaussBlur::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(gaussblur_debug, "gaussblur", 0, "blur of mattes");
  add_properties<GaussBlur>(klass, blur_properties(), &GaussBlur::values);
  add_statistics<GaussBlur>(klass,
                            "Counters since the element started: frames blurred, and frames passed "
                            "through untouched because sigma and threshold are 0.");
  set_metadata(klass, "Gaussian blur of mattes", "Filter/Effect/Video",
               "Blurs the alpha of RGBA frames, or GRAY8 frames, and leaves the colours alone");
  add_template(klass, "sink", GST_PAD_SINK, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));
  add_template(klass, "src", GST_PAD_SRC, GST_VIDEO_CAPS_MAKE("{ RGBA, GRAY8 }"));

  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->before_transform = before_transform;
  base_class->start = start;
  base_class->stop = stop;
  base_class->transform_ip_on_passthrough = FALSE;
  GST_VIDEO_FILTER_CLASS(klass)->transform_frame_ip = transform_frame_ip;
}

}  // namespace

GST_ELEMENT_REGISTER_DEFINE(gaussblur, "gaussblur", GST_RANK_NONE, type_of<GaussBlur>())
