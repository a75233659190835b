// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// composite with its inputs fed by hand: frames of 320x180, a subject's meshes.
#pragma once

#include <gst/check/gstharness.h>
#include <gst/video/video.h>

#include <cstdint>
#include <mutex>
#include <vector>

#include "element_checks.h"
#include "mesh_buffers.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull::test {

inline constexpr int width = 320, height = 180;
inline constexpr char background_caps[] =
    "video/x-raw,format=RGBA,width=320,height=180,framerate=25/1";

inline const synthetic::Photographed& subject() {
  static const synthetic::Photographed made = [] {
    synthetic::Photographed out = synthetic::photographed(
        synthetic::figure(8), synthetic::ring(3, 3.2, 1.5, {0, 1, 0}, 128, 128, 60.0));
    std::vector<Camera> cameras;
    for (const MeshView& view : out.mesh.views) cameras.push_back(view.calibration);
    out.mesh.texturing =
        texture_hull(out.mesh.hull, cameras, {.metric = TextureMetric::camera_normal});
    return out;
  }();
  return made;
}

inline GstBuffer* mesh_buffer(GstClockTime time, const Mesh& mesh = subject().mesh) {
  return mesh_buffer(mesh, time);
}

/// The bytes of \p buffer, which is given up.
inline std::vector<std::uint8_t> bytes_taken(GstBuffer* buffer) {
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
  std::vector<std::uint8_t> out(map.data, map.data + map.size);
  gst_buffer_unmap(buffer, &map);
  gst_buffer_unref(buffer);
  return out;
}

inline constexpr std::uint8_t grey = 90;

/// A plain frame, alpha included; \p padding more bytes per row than needed, told by a GstVideoMeta.
inline GstBuffer* frame(GstClockTime time, int padding = 0) {
  const gsize stride = 4 * width + static_cast<gsize>(padding);
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, stride * height, nullptr);
  gst_buffer_memset(buffer, 0, grey, stride * height);
  gsize offsets[4] = {0, 0, 0, 0};
  gint strides[4] = {static_cast<gint>(stride), 0, 0, 0};
  gst_buffer_add_video_meta_full(buffer, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_RGBA, width,
                                 height, 1, offsets, strides);
  GST_BUFFER_PTS(buffer) = time;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

/// The same, but opaque: nothing of it is a fill.
inline GstBuffer* opaque_frame(GstClockTime time, int padding = 0) {
  GstBuffer* buffer = frame(time, padding);
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_WRITE));
  for (gsize i = 3; i < map.size; i += 4) map.data[i] = 255;
  gst_buffer_unmap(buffer, &map);
  return buffer;
}

/// How many pixels of a frame are not the background's.
inline int changed_pixels(GstBuffer* buffer) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, GST_VIDEO_FORMAT_RGBA, width, height);
  GstVideoFrame video;
  fail_unless(gst_video_frame_map(&video, &info, buffer, GST_MAP_READ));
  int count = 0;
  for (int y = 0; y < height; ++y) {
    const auto* row = static_cast<const std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&video, 0)) +
                      static_cast<std::ptrdiff_t>(y) * GST_VIDEO_FRAME_PLANE_STRIDE(&video, 0);
    for (int x = 0; x < width; ++x)
      count += row[4 * x] != grey || row[4 * x + 1] != grey || row[4 * x + 2] != grey;
  }
  gst_video_frame_unmap(&video);
  return count;
}

/// composite with a background and a mesh input, fed by hand.
struct Bench {
  explicit Bench(bool with_mesh = true) {
    element = gst_element_factory_make("composite", nullptr);
    fail_unless(element != nullptr);
    gst_object_ref_sink(element);
    g_object_set(element, "eye-x", 0.0, "eye-y", 1.2, "eye-z", 4.0, "target-x", 0.0, "target-y",
                 1.0, "target-z", 0.0, nullptr);
    background = gst_harness_new_with_element(element, "background", "src");
    gst_harness_set_src_caps_str(background, background_caps);
    if (with_mesh) {
      mesh = gst_harness_new_with_element(element, "mesh_%u", nullptr);
      gst_harness_set_src_caps_str(mesh, mesh_caps);
    }
  }
  /// Begins with a subject in every frame.
  void show_subject(const char* backend) {
    wait_for_all();
    gst_util_set_object_arg(G_OBJECT(element), "backend", backend);
    gst_harness_push(mesh, mesh_buffer(0));
  }
  /// As from files: every input is waited for, however long it takes on a busy machine.
  void wait_for_all() {
    gst_harness_set_live(background, FALSE);
    gst_harness_set_live(mesh, FALSE);
  }
  ~Bench() {
    if (mesh) gst_harness_teardown(mesh);
    gst_harness_teardown(background);
    gst_object_unref(element);
  }
  GstBuffer* pull() {
    GstBuffer* buffer = gst_harness_pull(background);
    fail_unless(buffer != nullptr);
    return buffer;
  }
  /// Pushes a frame and the mesh after those of the frame, and takes what comes. The queue of a pad
  /// holds one buffer: whoever pushes more waits for the frame that they belong to.
  GstBuffer* step(GstBuffer* picture, GstBuffer* next_mesh) {
    gst_harness_push(background, picture);
    if (next_mesh) gst_harness_push(mesh, next_mesh);
    return pull();
  }
  GstElement* element;
  GstHarness* background;
  GstHarness* mesh = nullptr;
};

inline GstClockTime frame_time(int i) {
  return static_cast<GstClockTime>(i) * 40 * GST_MSECOND;
}

}  // namespace polyhull::test
