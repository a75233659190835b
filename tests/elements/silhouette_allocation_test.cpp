// SPDX-License-Identifier: LGPL-2.1-or-later
// What the silhouette elements take from memory per frame once the stream runs. GStreamer makes
// buffers, events and metas of its own, all small; planes, views and pixels must come from what is
// there already.
#include <gst/check/gstharness.h>

#include <cmath>
#include <cstdio>

#include "elements/element_checks.h"
#include "elements/frames.h"
#include "support/malloc_counter.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int width = 640, height = 480;

/// Frame \p i of a grey square that moves before green, in the bytes of BGRx, YUY2 or NV12.
GstBuffer* square_frame(const GstVideoInfo& info, int i) {
  GstBuffer* frame = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
  GstMapInfo map;
  gst_buffer_map(frame, &map, GST_MAP_WRITE);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const bool in = std::abs(x - 300 - 9 * i) < 120 && std::abs(y - 240) < 150;
      if (GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_BGRx) {
        std::uint8_t* p = map.data + (y * width + x) * 4;
        p[0] = in ? 120 : 60;
        p[1] = in ? 120 : 190;
        p[2] = in ? 120 : 30;
      } else if (GST_VIDEO_INFO_FORMAT(&info) == GST_VIDEO_FORMAT_YUY2) {
        std::uint8_t* p = map.data + (y * width + x) * 2;
        p[0] = in ? 120 : 130;
        p[1] = in ? 128 : x % 2 == 0 ? 90 : 70;
      } else {
        map.data[y * width + x] = in ? 120 : 130;
        map.data[width * height + y / 2 * width + x] = in ? 128 : x % 2 == 0 ? 90 : 70;
      }
    }
  gst_buffer_unmap(frame, &map);
  return frame;
}

}  // namespace

ELEMENT_TEST(small_pieces_only_once_the_stream_runs) {
  if (!counts_malloc()) return;
  constexpr std::size_t small = 4096;
  // The counter sees what it must see.
  std::vector<char> seen;
  const MallocCount self = count_mallocs([&] { seen.resize(100000); });
  fail_unless(self.taken >= 1 && self.largest >= seen.size());
  for (const char* line :
       {"silhouette camera=c", "silhouette camera=c blur-method=recursive", "chromamatte",
        "chromamatte ! gaussblur", "chromamatte ! gaussblur ! contourfind camera=c"}) {
    for (const char* format : {"BGRx", "NV12", "YUY2"}) {
      GstHarness* h = gst_harness_new_parse(line);
      GstCaps* caps = video_caps(format, width, height);
      GstVideoInfo info;
      gst_video_info_from_caps(&info, caps);
      gst_harness_set_src_caps(h, gst_caps_ref(caps));
      GstBuffer* frames[3];
      for (int i = 0; i < 3; ++i) frames[i] = square_frame(info, i);
      GstClockTime time = 0;
      const auto push = [&](int i) {
        GstBuffer* in = gst_buffer_copy(frames[i % 3]);
        GST_BUFFER_PTS(in) = time += GST_SECOND / 30;
        GstBuffer* out = gst_harness_push_and_pull(h, in);
        fail_unless(out != nullptr);
        gst_buffer_unref(out);
      };
      for (int i = 0; i < 12; ++i) push(i);
      constexpr int rounds = 30;
      const MallocCount count = count_mallocs([&] {
        for (int i = 0; i < rounds; ++i) push(i);
      });
      std::printf("%-50s %s: %.1f mallocs per frame, the largest of %zu bytes\n", line, format,
                  static_cast<double>(count.taken) / rounds, count.largest);
      fail_unless(count.largest <= small, "%s, %s: %zu bytes at once", line, format, count.largest);
      for (GstBuffer* frame : frames) gst_buffer_unref(frame);
      gst_caps_unref(caps);
      gst_harness_teardown(h);
    }
  }
}
