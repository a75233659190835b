// SPDX-License-Identifier: LGPL-2.1-or-later
// Colour sensors' mosaics through chromamatte and silhouette, and interlaced frames, which neither
// takes.
#include <gst/check/gstharness.h>
#include <gst/video/video.h>

#include <array>
#include <cmath>
#include <cstring>

#include "element_checks.h"
#include "views.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

// Odd, so that rows end in bytes that are no pixels.
constexpr int width = 131, height = 97;

std::string caps_of(const std::string& format) {
  return "video/x-bayer,format=" + format + ",width=" + std::to_string(width) +
         ",height=" + std::to_string(height) + ",framerate=25/1";
}

/// A red disk before a green screen; \p format begins with the four letters of its order.
GstBuffer* mosaic(const std::string& format, double x0) {
  const int bits = format.ends_with("10le") ? 10 : format.ends_with("12le") ? 12 : 8;
  const int bytes = bits > 8 ? 2 : 1;
  const int stride = GST_ROUND_UP_4(width * bytes);
  std::vector<guint8> all(static_cast<std::size_t>(stride * height), 0xa5);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double share = std::clamp(0.5 + 30.0 - std::hypot(x - x0, y - 48.0), 0.0, 1.0);
      const char letter = format[static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
      const double subject = letter == 'r' ? 190 : letter == 'g' ? 60 : 50;
      const double screen = letter == 'r' ? 40 : letter == 'g' ? 170 : 60;
      const auto sample =
          static_cast<unsigned>(std::ldexp(share * subject + (1.0 - share) * screen, bits - 8));
      all[static_cast<std::size_t>(y * stride + x * bytes)] = static_cast<guint8>(sample);
      if (bytes == 2)
        all[static_cast<std::size_t>(y * stride + x * bytes + 1)] =
            static_cast<guint8>(sample >> 8);
    }
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, all.size(), nullptr);
  gst_buffer_fill(buffer, 0, all.data(), all.size());
  GST_BUFFER_PTS(buffer) = 0;
  return buffer;
}

/// The same frame with \p padding bytes more in front and behind every row, as a meta without a
/// format's name tells.
GstBuffer* padded(GstBuffer* tight, int bytes, int padding) {
  const int from = GST_ROUND_UP_4(width * bytes), to = from + padding;
  GstMapInfo map;
  fail_unless(gst_buffer_map(tight, &map, GST_MAP_READ));
  std::vector<guint8> all(static_cast<std::size_t>(padding + to * height), 0x5a);
  for (int y = 0; y < height; ++y)
    std::memcpy(&all[static_cast<std::size_t>(padding + y * to)], map.data + y * from,
                static_cast<std::size_t>(width * bytes));
  gst_buffer_unmap(tight, &map);
  gst_buffer_unref(tight);
  GstBuffer* buffer = gst_buffer_new_memdup(all.data(), all.size());
  GST_BUFFER_PTS(buffer) = 0;
  gsize offsets[GST_VIDEO_MAX_PLANES] = {static_cast<gsize>(padding)};
  gint strides[GST_VIDEO_MAX_PLANES] = {to};
  gst_buffer_add_video_meta_full(buffer, GST_VIDEO_FRAME_FLAG_NONE, GST_VIDEO_FORMAT_ENCODED, width,
                                 height, 1, offsets, strides);
  return buffer;
}

}  // namespace

// Every order and depth: the one pass sends the chain's bytes, the contours run around the disk, and
// its pixels are the disk's.
ELEMENT_TEST(mosaics_of_every_order_and_depth) {
  for (const char* order : {"bggr", "gbrg", "grbg", "rggb"})
    for (const char* depth : {"", "10le", "12le"}) {
      const std::string format = std::string(order) + depth;
      GstHarness* chain =
          gst_harness_new_parse("chromamatte ! gaussblur ! contourfind camera=c tolerance=0");
      GstHarness* one = gst_harness_new_parse("silhouette camera=c tolerance=0");
      for (GstHarness* harness : {chain, one})
        gst_harness_set_src_caps_str(harness, caps_of(format).c_str());
      for (const double x0 : {60.0, 66.5}) {
        const ReadView a = take_view(gst_harness_push_and_pull(chain, mosaic(format, x0)));
        const ReadView b = take_view(gst_harness_push_and_pull(one, mosaic(format, x0)));
        fail_unless(a.view.contours == b.view.contours, "%s", format.c_str());
        fail_unless(a.bytes == b.bytes, "%s", format.c_str());
        fail_unless_equals_int(b.view.contours.ends.size(), 1);
        for (const Vec2f& p : b.view.contours.points) {
          const double off = std::hypot(p.x - x0, p.y - 48.0) - 30.0;
          fail_unless(std::abs(off) < 0.4, "%s: %.2f px off", format.c_str(), off);
        }
        const Rectangle roi = b.view.roi;
        const int at = 4 * ((48 - roi.y) * roi.width + static_cast<int>(x0) - roi.x);
        const std::array<int, 4> expected{190, 60, 50, 255};
        for (std::size_t c = 0; c < 4; ++c)
          fail_unless(std::abs(static_cast<int>(b.bytes[static_cast<std::size_t>(at) + c]) -
                               expected[c]) <= 1,
                      "%s: channel %d is %d", format.c_str(), static_cast<int>(c),
                      static_cast<int>(b.bytes[static_cast<std::size_t>(at) + c]));
      }
      gst_harness_teardown(chain);
      gst_harness_teardown(one);
    }
}

ELEMENT_TEST(rows_lie_where_the_meta_says) {
  for (const auto& [format, bytes] : {std::pair{"rggb", 1}, std::pair{"gbrg12le", 2}}) {
    GstHarness* harness = gst_harness_new_parse("silhouette camera=c tolerance=0");
    gst_harness_set_src_caps_str(harness, caps_of(format).c_str());
    const ReadView plain = take_view(gst_harness_push_and_pull(harness, mosaic(format, 60.0)));
    const ReadView wide =
        take_view(gst_harness_push_and_pull(harness, padded(mosaic(format, 60.0), bytes, 60)));
    fail_unless(plain.view.contours == wide.view.contours, "%s", format);
    fail_unless(plain.bytes == wide.bytes, "%s", format);
    gst_harness_teardown(harness);
  }
}

ELEMENT_TEST(rows_beyond_the_buffer_are_an_error) {
  GstHarness* harness = gst_harness_new_parse("silhouette camera=c");
  gst_harness_set_src_caps_str(harness, caps_of("rggb").c_str());
  GstBuffer* buffer = padded(mosaic("rggb", 60.0), 1, 60);
  gst_buffer_set_size(buffer, static_cast<gssize>(gst_buffer_get_size(buffer)) - 80);
  fail_unless_equals_int(gst_harness_push(harness, buffer), GST_FLOW_ERROR);
  gst_harness_teardown(harness);
}

// GStreamer's own source, which attaches a description of the frame that fits no format.
ELEMENT_TEST(takes_videotestsrcs_mosaics) {
  for (const char* element : {"chromamatte", "silhouette"})
    check_ended(run_to_end(std::string("videotestsrc num-buffers=3 ! "
                                       "video/x-bayer,format=grbg,width=321,height=240 ! ") +
                           element + " ! fakesink"));
}

ELEMENT_TEST(a_mosaic_too_short_is_an_error) {
  GstElement* pipeline = parse(
      "fakesrc num-buffers=1 sizetype=fixed sizemax=1000 ! "
      "video/x-bayer,format=rggb,width=64,height=48,framerate=25/1 ! "
      "silhouette ! fakesink");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const std::string end = wait_for_end(pipeline);
  fail_unless(end.find("1000 bytes cannot be mapped") != std::string::npos, "%s", end.c_str());
  stop(pipeline);
}

ELEMENT_TEST(interlaced_frames_are_refused) {
  for (const char* element : {"chromamatte", "silhouette"})
    for (const char* mode : {"interleaved", "mixed"}) {
      const std::string end =
          run_to_end(std::string("videotestsrc num-buffers=3 ! video/x-raw,format=I420 ! "
                                 "capssetter caps=video/x-raw,interlace-mode=") +
                     mode + " ! " + element + " ! fakesink");
      fail_unless(end.find("put \"deinterlace\" in front") != std::string::npos &&
                      end.find(mode) != std::string::npos,
                  "%s: %s", element, end.c_str());
    }
}
