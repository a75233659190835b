// SPDX-License-Identifier: LGPL-2.1-or-later
// What chromamatte makes of luma and chroma, against double precision: samples as GStreamer's own
// format description reads them, chroma between them by the caps' chroma-site, colours by their
// colorimetry.
#include <gst/check/gstharness.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "elements/element_checks.h"
#include "elements/frames.h"

using namespace polyhull::test;

namespace {

constexpr int width = 70;  // no multiple of six or sixteen
constexpr int height = 14;

/// Samples of one frame, 0..1 for luma, -0.5..0.5 for chroma.
class Samples {
 public:
  Samples(const GstVideoInfo& info, GstBuffer* buffer) : info_(info) {
    GstVideoFrame frame;
    fail_unless(gst_video_frame_map(&frame, &info, buffer, GST_MAP_READ));
    const GstVideoFormatInfo* format = info.finfo;
    const bool ten = format->unpack_format == GST_VIDEO_FORMAT_AYUV64;
    std::vector<std::uint16_t> words(width * 4 + 64);
    gint offset[GST_VIDEO_MAX_COMPONENTS], scale[GST_VIDEO_MAX_COMPONENTS];
    gst_video_color_range_offsets(info.colorimetry.range,
                                  gst_video_format_get_info(format->unpack_format), offset, scale);
    for (int y = 0; y < height; ++y) {
      format->unpack_func(format, GST_VIDEO_PACK_FLAG_TRUNCATE_RANGE, words.data(), frame.data,
                          frame.info.stride, 0, y, width);
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(words.data());
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c) {
          // Ten or twelve bits are the upper ones of sixteen, and so are their bounds.
          const double stored = ten ? words[4 * x + 1 + c] : bytes[4 * x + 1 + c];
          const int spare = 16 - static_cast<int>(GST_VIDEO_FORMAT_INFO_DEPTH(format, 0));
          const double full = info.colorimetry.range == GST_VIDEO_COLOR_RANGE_0_255 && ten
                                  ? 65536.0 - (1 << spare)
                                  : scale[c];
          values_[c][y][x] = (stored - offset[c]) / full;
        }
    }
    gst_video_frame_unmap(&frame);
  }

  double luma(int x, int y) const { return values_[0][y][x]; }

  /// Unpacked, each pixel has the sample of its pair (and of its pair of rows).
  double chroma(int c, int x, int y) const {
    const GstVideoChromaSite site = info_.chroma_site;
    if (GST_VIDEO_FORMAT_INFO_W_SUB(info_.finfo, 1) == 0) return values_[c][y][x];
    const bool rows = GST_VIDEO_FORMAT_INFO_H_SUB(info_.finfo, 1) != 0;
    const auto stored = [&](int i, int j) {
      const int column = std::clamp(2 * i, 0, width - 1);
      return values_[c][std::clamp(rows ? 2 * j : j, 0, height - 1)][column];
    };
    const double u = site & GST_VIDEO_CHROMA_SITE_H_COSITED ? x / 2.0 : (x - 0.5) / 2.0;
    const double v = !rows ? y : site & GST_VIDEO_CHROMA_SITE_V_COSITED ? y / 2.0 : (y - 0.5) / 2;
    const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
    const double s = u - i, t = v - j;
    const auto across = [&](int row) { return (1 - s) * stored(i, row) + s * stored(i + 1, row); };
    return t == 0.0 ? across(j) : (1 - t) * across(j) + t * across(j + 1);
  }

  /// Red, green and blue in levels.
  std::array<double, 3> colour(int x, int y) const {
    gdouble kr = 0.0, kb = 0.0;
    fail_unless(gst_video_color_matrix_get_Kr_Kb(info_.colorimetry.matrix, &kr, &kb));
    const double l = luma(x, y);
    const double red = l + 2 * (1 - kr) * chroma(2, x, y);
    const double blue = l + 2 * (1 - kb) * chroma(1, x, y);
    return {255 * red, 255 * (l - kr * red - kb * blue) / (1 - kr - kb), 255 * blue};
  }

 private:
  GstVideoInfo info_;
  double values_[3][height][width];
};

/// Random luma, and chroma in waves with a little noise: inside the RGB cube, from the screen's
/// hue to the subject's. (The key is interpolated after its two forms are compared, which random
/// chroma would show.)
GstBuffer* random_frame(const GstVideoInfo& info) {
  std::mt19937 random(5);
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
  gst_buffer_memset(buffer, 0, 0, -1);
  GstVideoFrame frame;
  fail_unless(gst_video_frame_map(&frame, &info, buffer, GST_MAP_WRITE));
  const GstVideoFormatInfo* format = info.finfo;
  const bool ten = format->unpack_format == GST_VIDEO_FORMAT_AYUV64;
  std::vector<std::uint16_t> words(width * 4);
  auto* bytes = reinterpret_cast<std::uint8_t*>(words.data());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double wave = 120.0 * std::sin(x * 0.35 + y * 0.9);
      const double samples[4] = {0.0, 400.0 + random() % 200, 500.0 - 0.3 * wave + random() % 8,
                                 510.0 + wave + random() % 8};
      for (int c = 0; c < 4; ++c) {
        const auto v = static_cast<unsigned>(samples[c]);
        if (ten)
          words[4 * x + c] = static_cast<std::uint16_t>(v << 6);
        else
          bytes[4 * x + c] = static_cast<std::uint8_t>(v >> 2);
      }
    }
    format->pack_func(format, GST_VIDEO_PACK_FLAG_NONE, words.data(), 0, frame.data,
                      frame.info.stride, info.chroma_site, y, width);
  }
  gst_video_frame_unmap(&frame);
  return buffer;
}

GstCaps* caps_of(const char* format, const char* colorimetry, const char* site) {
  GstCaps* caps = video_caps(format, width, height);
  gst_caps_set_simple(caps, "colorimetry", G_TYPE_STRING, colorimetry, "chroma-site", G_TYPE_STRING,
                      site, nullptr);
  return caps;
}

constexpr const char* key = "chromamatte spill=0 screen-colour=0x1ebe3c foreground-colour=0xc85a96";

/// A random frame of the coding becomes its colours, and its matte is that of the same colours as RGBx: it must
/// not depend on how they were coded.
void expect_colours(const char* format, const char* colorimetry, const char* site) {
  GstCaps* caps = caps_of(format, colorimetry, site);
  GstVideoInfo info;
  fail_unless(gst_video_info_from_caps(&info, caps));
  GstBuffer* in = random_frame(info);
  const Samples samples(info, in);
  GstHarness* yuv = gst_harness_new_parse(key);
  gst_harness_set_src_caps(yuv, caps);
  GstBuffer* out = gst_harness_push_and_pull(yuv, in);

  // The same colours as RGBx.
  GstHarness* rgb = gst_harness_new_parse(key);
  gst_harness_set_src_caps(rgb, video_caps("RGBx", width, height));
  GstBuffer* exact = gst_buffer_new_allocate(nullptr, width * height * 4, nullptr);
  gst_buffer_memset(exact, 0, 255, -1);
  GstMapInfo map;
  gst_buffer_map(exact, &map, GST_MAP_WRITE);
  double worst = 0.0;
  for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
    const std::array<double, 3> colour = samples.colour(x, y);
    for (int c = 0; c < 3; ++c) {
      fail_unless(colour[c] > 1.0 && colour[c] < 254.0, "outside the cube: %g", colour[c]);
      worst = std::max(worst, std::abs(p[c] - colour[c]));
      map.data[(y * width + x) * 4 + c] = static_cast<guint8>(std::lround(colour[c]));
    }
  });
  gst_buffer_unmap(exact, &map);
  fail_unless(worst <= 1.0, "%s %s %s: colours differ by %g", format, colorimetry, site, worst);
  exact = gst_harness_push_and_pull(rgb, exact);
  std::vector<int> alpha;
  for_each_pixel(exact, width, height,
                 [&](int, int, const std::uint8_t* p) { alpha.push_back(p[3]); });
  int most = 0, mixed = 0, sum = 0;
  for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
    const int other = alpha[y * width + x];
    most = std::max(most, std::abs(p[3] - other));
    sum += std::abs(p[3] - other);
    mixed += other != 0 && other != 255;
  });
  fail_unless(mixed > width * height / 2, "%s: only %d mixed pixels", format, mixed);
  const double mean = double(sum) / (width * height);
  // Three times as much where the chroma is taken to lie elsewhere.
  fail_unless(mean <= 1.5 && most <= 14, "%s %s %s: the matte differs by %g, at most %d", format,
              colorimetry, site, mean, most);
  gst_buffer_unref(out);
  gst_buffer_unref(exact);
  gst_harness_teardown(yuv);
  gst_harness_teardown(rgb);
}

}  // namespace

ELEMENT_TEST(every_coding_becomes_its_colours) {
  for (const char* format :
       {"I420",      "NV12",      "YUY2",      "UYVY",    "I420_10LE", "v210",      "NV21",
        "YV12",      "Y42B",      "NV16",      "NV61",    "YVYU",      "Y444",      "NV24",
        "v308",      "AYUV",      "VUYA",      "A420",    "P010_10LE", "I422_10LE", "Y444_10LE",
        "A420_10LE", "A422_10LE", "A444_10LE", "P012_LE", "I420_12LE", "I422_12LE", "Y444_12LE"}) {
    // Range 1 is full and 2 limited; matrix 3 is BT.709, 4 BT.601, 6 BT.2020.
    for (const char* colorimetry : {"bt601", "bt709", "bt2020", "1:4:5:1", "1:3:5:1", "1:6:13:7"}) {
      for (const char* site : {"mpeg2", "jpeg", "cosited", "v-cosited"})
        expect_colours(format, colorimetry, site);
    }
  }
}

/// Caps that say nothing mean what GStreamer takes them to mean: BT.601 and chroma between the
/// columns for small pictures, BT.709 and chroma on even columns from HD on, limited range.
ELEMENT_TEST(open_colorimetry_is_gstreamers) {
  const struct {
    int w, h;
    const char *colorimetry, *site;
  } cases[] = {{320, 240, "bt601", "jpeg"}, {1280, 720, "bt709", "mpeg2"}};
  for (const auto& c : cases) {
    std::vector<std::uint8_t> before;
    for (const bool open : {true, false}) {
      GstCaps* caps = video_caps("NV12", c.w, c.h);
      if (!open)
        gst_caps_set_simple(caps, "colorimetry", G_TYPE_STRING, c.colorimetry, "chroma-site",
                            G_TYPE_STRING, c.site, nullptr);
      GstVideoInfo info;
      gst_video_info_from_caps(&info, caps);
      GstBuffer* in = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
      GstMapInfo map;
      gst_buffer_map(in, &map, GST_MAP_WRITE);
      for (gsize i = 0; i < map.size; ++i) map.data[i] = static_cast<guint8>(90 + i * 7 % 70);
      gst_buffer_unmap(in, &map);
      GstHarness* h = gst_harness_new_parse(key);
      gst_harness_set_src_caps(h, caps);
      GstBuffer* out = gst_harness_push_and_pull(h, in);
      std::vector<std::uint8_t> bytes(gst_buffer_get_size(out));
      gst_buffer_extract(out, 0, bytes.data(), bytes.size());
      fail_unless(open || bytes == before, "%dx%d", c.w, c.h);
      before = bytes;
      gst_buffer_unref(out);
      gst_harness_teardown(h);
    }
  }
}

/// Every order of red, green and blue, packed and planar, is the same picture.
ELEMENT_TEST(every_order_of_rgb_is_the_same) {
  std::vector<std::uint8_t> before;
  for (const char* format : {"RGBx", "xRGB", "xBGR", "ARGB", "ABGR", "RGB", "BGR", "GBR", "GBRA",
                             "GBR_10LE", "GBR_12LE"}) {
    GstHarness* h = gst_harness_new_parse(
        (std::string("videoconvert dither=none ! video/x-raw,format=") + format + " ! " + key)
            .c_str());
    GstCaps* caps = video_caps("RGBx", width, height);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    GstBuffer* out = gst_harness_push_and_pull(h, disk_frame(caps, {30, 7, 5}));
    std::vector<std::uint8_t> bytes(gst_buffer_get_size(out));
    gst_buffer_extract(out, 0, bytes.data(), bytes.size());
    if (before.empty()) before = bytes;
    fail_unless_equals_int(bytes.size(), before.size());
    for (std::size_t i = 0; i < bytes.size(); ++i)
      fail_unless(std::abs(bytes[i] - before[i]) <= 1, "%s: %d instead of %d at %d", format,
                  bytes[i], before[i], static_cast<int>(i));
    gst_buffer_unref(out);
    gst_caps_unref(caps);
    gst_harness_teardown(h);
  }
}

/// RGB goes through as it is, so its range is announced as it came.
ELEMENT_TEST(limited_range_rgb_stays_so) {
  for (const auto& [in, range] : {std::pair{"1:1:7:1", GST_VIDEO_COLOR_RANGE_0_255},
                                  {"2:1:7:1", GST_VIDEO_COLOR_RANGE_16_235}}) {
    GstHarness* h = gst_harness_new_parse(key);
    GstCaps* caps = video_caps("RGBx", width, height);
    gst_caps_set_simple(caps, "colorimetry", G_TYPE_STRING, in, nullptr);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    gst_buffer_unref(gst_harness_push_and_pull(h, disk_frame(caps, {30, 7, 5})));
    GstCaps* out = gst_pad_get_current_caps(h->sinkpad);
    GstVideoInfo info;
    gst_video_info_from_caps(&info, out);
    fail_unless_equals_int(info.colorimetry.range, range);
    gst_caps_unref(out);
    gst_caps_unref(caps);
    gst_harness_teardown(h);
  }
}
