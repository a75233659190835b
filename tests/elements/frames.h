// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Frames for element tests: a subject of known shape in front of a screen.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include "elements/element_checks.h"

namespace polyhull::test {

struct Colour {
  double r, g, b;
};

/// Fraction of a pixel, 0 to 1, that a disk covers; good to about 0.01.
inline double disk_cover(double x, double y, double cx, double cy, double radius) {
  return std::clamp(radius - std::hypot(x - cx, y - cy) + 0.5, 0.0, 1.0);
}

struct Disk {
  double cx, cy, radius;
  Colour subject{200, 90, 70};
  Colour screen{30, 190, 60};
};

/// Caps of system-memory video without a stride of its own.
inline GstCaps* video_caps(const char* format, int width, int height, int fps = 30) {
  return gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING, format, "width", G_TYPE_INT,
                             width, "height", G_TYPE_INT, height, "framerate", GST_TYPE_FRACTION,
                             fps, 1, nullptr);
}

/// A frame of \p caps' size in one of the packed RGB formats or GRAY8 (then the matte, 255 inside).
inline GstBuffer* disk_frame(GstCaps* caps, const Disk& disk, GstClockTime pts = 0) {
  GstVideoInfo info;
  fail_unless(gst_video_info_from_caps(&info, caps));
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
  GstVideoFrame frame;
  fail_unless(gst_video_frame_map(&frame, &info, buffer, GST_MAP_WRITE));
  const bool grey = GST_VIDEO_INFO_IS_GRAY(&info);
  const int step = GST_VIDEO_INFO_COMP_PSTRIDE(&info, 0);
  for (int y = 0; y < GST_VIDEO_INFO_HEIGHT(&info); ++y) {
    for (int x = 0; x < GST_VIDEO_INFO_WIDTH(&info); ++x) {
      const double a = disk_cover(x, y, disk.cx, disk.cy, disk.radius);
      auto* base = static_cast<std::uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0)) +
                   GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0) * y + step * x;
      if (grey) {
        *base = static_cast<std::uint8_t>(std::lround(255 * a));
        continue;
      }
      const auto put = [&](int component, double front, double back) {
        base[GST_VIDEO_INFO_COMP_POFFSET(&info, component)] =
            static_cast<std::uint8_t>(std::lround(a * front + (1 - a) * back));
      };
      put(0, disk.subject.r, disk.screen.r);
      put(1, disk.subject.g, disk.screen.g);
      put(2, disk.subject.b, disk.screen.b);
      if (step == 4) {
        const bool alpha = GST_VIDEO_INFO_HAS_ALPHA(&info);
        const int offset = alpha ? GST_VIDEO_INFO_COMP_POFFSET(&info, 3) : 3;
        base[offset] = alpha ? static_cast<std::uint8_t>(std::lround(255 * a)) : 255;
      }
    }
  }
  gst_video_frame_unmap(&frame);
  GST_BUFFER_PTS(buffer) = pts;
  GST_BUFFER_DURATION(buffer) = GST_SECOND / 30;
  return buffer;
}

/// Calls \p each(x, y, pixel) for every pixel of a packed 4-byte buffer.
inline void for_each_pixel(GstBuffer* buffer, int width, int height,
                           const std::function<void(int, int, const std::uint8_t*)>& each) {
  GstMapInfo map;
  fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
  fail_unless_equals_int(static_cast<int>(map.size), width * height * 4);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) each(x, y, map.data + (static_cast<gsize>(y) * width + x) * 4);
  }
  gst_buffer_unmap(buffer, &map);
}

/// Sum of the alpha of a packed RGBA buffer in whole pixels.
inline double alpha_area(GstBuffer* buffer, int width, int height) {
  double sum = 0.0;
  for_each_pixel(buffer, width, height,
                 [&](int, int, const std::uint8_t* p) { sum += p[3] / 255.0; });
  return sum;
}

/// Seeks a few times in the pipeline \p line before it plays to its end.
inline void expect_survives_flush_and_seek(const std::string& line) {
  GstElement* pipeline = parse(line);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND);
  for (int i = 0; i < 6; ++i)
    fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                        (i % 3) * 700 * GST_MSECOND));
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  stop(pipeline);
}

}  // namespace polyhull::test
