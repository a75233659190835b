// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/check/gstharness.h>

#include <cmath>
#include <vector>

#include "elements/controlled.h"
#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"

using namespace polyhull::test;

namespace {

constexpr int width = 75;
constexpr int height = 52;
const Disk subject{33.3, 24.7, 16.0};

/// The Gaussian of a plane in double precision, border values continued.
std::vector<double> exact_blur(const std::vector<double>& plane, int w, int h, double sigma) {
  const int radius = static_cast<int>(std::ceil(6 * sigma));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int i = -radius; i <= radius; ++i) {
    kernel.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += kernel.back();
  }
  const auto at = [](const std::vector<double>& p, int w, int h, int x, int y) {
    return p[static_cast<std::size_t>(std::clamp(y, 0, h - 1)) * w + std::clamp(x, 0, w - 1)];
  };
  std::vector<double> rows(plane.size()), result(plane.size());
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<double>& from = pass == 0 ? plane : rows;
    std::vector<double>& to = pass == 0 ? rows : result;
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        double value = 0.0;
        for (int i = -radius; i <= radius; ++i) {
          value += kernel[i + radius] *
                   (pass == 0 ? at(from, w, h, x + i, y) : at(from, w, h, x, y + i));
        }
        to[static_cast<std::size_t>(y) * w + x] = value / sum;
      }
    }
  }
  return result;
}

/// Pushes a frame, returns what comes out; the caller owns it.
GstBuffer* pushed(GstHarness* h, const char* format, const Disk& disk, GstClockTime pts = 0) {
  GstCaps* caps = video_caps(format, width, height);
  GstBuffer* out = gst_harness_push_and_pull(h, disk_frame(caps, disk, pts));
  gst_caps_unref(caps);
  return out;
}

GstHarness* harness_for(const std::string& description, const char* format = "RGBA") {
  GstHarness* h = gst_harness_new_parse(description.c_str());
  gst_harness_set_src_caps(h, video_caps(format, width, height));
  return h;
}

/// Largest difference between the element's alpha and the exact blur of the alpha that went in.
double largest_error(const std::string& properties, double sigma, const char* format) {
  const int step = std::string(format) == "RGBA" ? 4 : 1;
  GstHarness* h = harness_for("gaussblur " + properties, format);
  GstCaps* caps = video_caps(format, width, height);
  GstBuffer* in = disk_frame(caps, subject);
  GstVideoInfo info;
  gst_video_info_from_caps(&info, caps);
  const int stride = GST_VIDEO_INFO_PLANE_STRIDE(&info, 0);
  const std::vector<std::uint8_t> before = bytes_of(in);
  GstBuffer* out = gst_harness_push_and_pull(h, in);
  const std::vector<std::uint8_t> after = bytes_of(out);
  std::vector<double> plane;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.push_back(before[y * stride + x * step + step - 1]);
  }
  const std::vector<double> exact = exact_blur(plane, width, height, sigma);
  double worst = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int at = y * stride + x * step;
      worst = std::max(worst, std::abs(after[at + step - 1] - exact[y * width + x]));
      for (int c = 0; c + 1 < step; ++c) fail_unless_equals_int(after[at + c], before[at + c]);
    }
  }
  gst_buffer_unref(out);
  gst_caps_unref(caps);
  gst_harness_teardown(h);
  return worst;
}

}  // namespace

ELEMENT_TEST(says_what_it_is) {
  check_documented("gaussblur");
}

ELEMENT_TEST(goes_up_and_down) {
  check_states(
      "videotestsrc num-buffers=30 pattern=ball background-color=0xff1ebe3c ! "
      "chromamatte ! gaussblur sigma=3 ! fakesink");
  check_states(
      "videotestsrc num-buffers=5 ! video/x-raw,format=GRAY8 ! gaussblur sigma=0 ! fakesink", 6);
}

ELEMENT_TEST(blurs_alpha_and_grey_and_nothing_else) {
  for (const char* format : {"RGBA", "GRAY8"}) {
    for (const double sigma : {0.5, 1.0, 2.0, 4.0, 9.5}) {
      const std::string text = "sigma=" + std::to_string(sigma);
      // Half a level is the rounding to 8 bits.
      const double fir = largest_error(text, sigma, format);
      fail_unless(fir <= 0.5 + 0.5, "%s fir %g: %g", format, sigma, fir);
      if (sigma < 1.5) continue;
      const double recursive = largest_error(text + " method=recursive", sigma, format);
      fail_unless(recursive <= 0.5 + 0.7, "%s recursive %g: %g", format, sigma, recursive);
    }
    const double box = largest_error("sigma=4 method=box passes=5", 4.0, format);
    fail_unless(box <= 6.0, "%s box: %g", format, box);
  }
}

ELEMENT_TEST(sigma_beyond_the_picture) {
  fail_unless(largest_error("sigma=100", 100.0, "GRAY8") <= 1.0);
}

ELEMENT_TEST(threshold_makes_it_binary) {
  GstHarness* h = harness_for("gaussblur sigma=2 threshold=128");
  GstHarness* soft = harness_for("gaussblur sigma=2");
  GstBuffer* out = pushed(h, "RGBA", subject);
  GstBuffer* grey = pushed(soft, "RGBA", subject);
  const std::vector<std::uint8_t> binary = bytes_of(out);
  const std::vector<std::uint8_t> levels = bytes_of(grey);
  for (std::size_t i = 3; i < binary.size(); i += 4) {
    fail_unless_equals_int(binary[i], levels[i] >= 128 ? 255 : 0);
  }
  gst_buffer_unref(out);
  gst_buffer_unref(grey);
  gst_harness_teardown(h);
  gst_harness_teardown(soft);
}

ELEMENT_TEST(nothing_to_do_passes_the_buffer_through) {
  GstHarness* h = harness_for("gaussblur sigma=0 threshold=0");
  GstElement* blur = gst_harness_find_element(h, "gaussblur");
  GstCaps* caps = video_caps("RGBA", width, height);
  GstBuffer* in = disk_frame(caps, subject);
  GstMemory* memory = gst_buffer_peek_memory(in, 0);
  GstBuffer* out = gst_harness_push_and_pull(h, in);
  fail_unless(out == in, "copied");
  fail_unless(gst_buffer_peek_memory(out, 0) == memory);
  fail_unless_equals_int(static_cast<int>(statistic(blur, "passed-through")), 1);
  fail_unless_equals_int(static_cast<int>(statistic(blur, "frames")), 0);
  gst_buffer_unref(out);

  // Live: the next frame is blurred, the one after it passes again.
  g_object_set(blur, "sigma", 3.0, nullptr);
  in = disk_frame(caps, subject, GST_SECOND);
  const std::vector<std::uint8_t> before = bytes_of(in);
  out = gst_harness_push_and_pull(h, in);
  fail_if(bytes_of(out) == before);
  gst_buffer_unref(out);
  g_object_set(blur, "sigma", 0.0, nullptr);
  in = disk_frame(caps, subject, 2 * GST_SECOND);
  out = gst_harness_push_and_pull(h, in);
  fail_unless(out == in);
  gst_buffer_unref(out);
  gst_caps_unref(caps);
  gst_object_unref(blur);
  gst_harness_teardown(h);
}

ELEMENT_TEST(a_shared_frame_is_not_written_to) {
  GstHarness* h = harness_for("gaussblur sigma=2");
  GstCaps* caps = video_caps("RGBA", width, height);
  GstBuffer* in = disk_frame(caps, subject);
  const std::vector<std::uint8_t> before = bytes_of(in);
  gst_buffer_ref(in);
  GstBuffer* out = gst_harness_push_and_pull(h, in);
  fail_unless(bytes_of(in) == before);
  fail_if(bytes_of(out) == before);
  gst_buffer_unref(in);
  gst_buffer_unref(out);
  gst_caps_unref(caps);
  gst_harness_teardown(h);
}

/// The plane that chromamatte attaches is only a short cut: what comes out is the same without it.
ELEMENT_TEST(the_attached_matte_changes_nothing) {
  GstHarness* chain = gst_harness_new_parse("chromamatte ! gaussblur sigma=2.5");
  GstHarness* key = gst_harness_new("chromamatte");
  GstHarness* blur = gst_harness_new_parse("gaussblur sigma=2.5");
  gst_harness_set_src_caps(chain, video_caps("RGBx", width, height));
  gst_harness_set_src_caps(key, video_caps("RGBx", width, height));
  gst_harness_set_src_caps(blur, video_caps("RGBA", width, height));
  GstBuffer* expected = pushed(chain, "RGBx", subject);
  GstBuffer* keyed = pushed(key, "RGBx", subject);
  const std::vector<std::uint8_t> bytes = bytes_of(keyed);
  GstBuffer* bare = gst_buffer_new_allocate(nullptr, bytes.size(), nullptr);
  gst_buffer_fill(bare, 0, bytes.data(), bytes.size());
  GstBuffer* out = gst_harness_push_and_pull(blur, bare);
  fail_unless(bytes_of(out) == bytes_of(expected));

  // Somebody draws into the alpha in place: the plane attached is no longer true and is not used.
  GstMapInfo map;
  keyed = gst_buffer_make_writable(keyed);
  fail_unless(gst_buffer_map(keyed, &map, GST_MAP_READWRITE));
  for (gsize i = 3; i < map.size; i += 4) map.data[i] = 255 - map.data[i];
  gst_buffer_unmap(keyed, &map);
  const std::vector<std::uint8_t> inverted = bytes_of(keyed);
  GstBuffer* from_drawn = gst_harness_push_and_pull(blur, keyed);
  bare = gst_buffer_new_allocate(nullptr, inverted.size(), nullptr);
  gst_buffer_fill(bare, 0, inverted.data(), inverted.size());
  GstBuffer* from_bare = gst_harness_push_and_pull(blur, bare);
  fail_unless(bytes_of(from_drawn) == bytes_of(from_bare));

  for (GstBuffer* buffer : {expected, out, from_drawn, from_bare}) gst_buffer_unref(buffer);
  for (GstHarness* h : {chain, key, blur}) gst_harness_teardown(h);
}

/// One pixel, wherever it is drawn into a keyed or blurred frame in place, is seen by the elements
/// behind; also in a copy, whose memory tells nothing of writes.
ELEMENT_TEST(one_pixel_drawn_in_place_is_seen) {
  for (const char* front : {"chromamatte", "chromamatte ! gaussblur sigma=1.5"}) {
    GstHarness* key = gst_harness_new_parse(front);
    GstHarness* blur = gst_harness_new_parse("gaussblur sigma=2.5");
    GstHarness* find = gst_harness_new_parse(
        "contourfind camera=c min-area=0 min-edges=3 tolerance=0 reuse=false");
    gst_harness_set_src_caps(key, video_caps("RGBx", width, height));
    gst_harness_set_src_caps(blur, video_caps("RGBA", width, height));
    gst_harness_set_src_caps(find, video_caps("RGBA", width, height));
    for (const auto& [x, y] : {std::pair{13, 9}, {width - 1, height - 1}, {40, 31}, {0, 0}}) {
      for (const bool copied : {false, true}) {
        GstBuffer* drawn = pushed(key, "RGBx", subject);
        if (copied) {
          GstBuffer* copy = gst_buffer_copy_deep(drawn);
          gst_buffer_unref(drawn);
          drawn = copy;
        }
        GstMapInfo map;
        fail_unless(gst_buffer_map(drawn, &map, GST_MAP_READWRITE));
        std::uint8_t& alpha = map.data[(y * width + x) * 4 + 3];
        alpha = alpha < 128 ? 255 : 0;
        gst_buffer_unmap(drawn, &map);
        const std::vector<std::uint8_t> bytes = bytes_of(drawn);
        GstBuffer* bare = gst_buffer_new_allocate(nullptr, bytes.size(), nullptr);
        gst_buffer_fill(bare, 0, bytes.data(), bytes.size());

        const std::size_t rings =
            take_view(gst_harness_push_and_pull(find, gst_buffer_ref(drawn))).view.contours.size();
        fail_unless_equals_int(static_cast<int>(rings), 2);
        GstBuffer* from_drawn = gst_harness_push_and_pull(blur, drawn);
        GstBuffer* from_bare = gst_harness_push_and_pull(blur, bare);
        fail_unless(bytes_of(from_drawn) == bytes_of(from_bare), "%s at %d,%d", front, x, y);
        gst_buffer_unref(from_drawn);
        gst_buffer_unref(from_bare);
      }
    }
    for (GstHarness* h : {key, blur, find}) gst_harness_teardown(h);
  }
}

ELEMENT_TEST(changes_size_and_format_in_the_stream) {
  GstHarness* h = gst_harness_new_parse("gaussblur sigma=2");
  const struct {
    const char* format;
    int w, h;
  } rounds[] = {{"RGBA", 64, 48}, {"GRAY8", 33, 21}, {"RGBA", 1, 1}, {"GRAY8", 200, 7}};
  for (const auto& round : rounds) {
    GstCaps* caps = video_caps(round.format, round.w, round.h);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    GstBuffer* in = disk_frame(caps, {round.w / 2.0, round.h / 2.0, round.h / 3.0});
    const gsize size = gst_buffer_get_size(in);
    GstBuffer* out = gst_harness_push_and_pull(h, in);
    fail_unless_equals_uint64(gst_buffer_get_size(out), size);
    gst_buffer_unref(out);
    gst_caps_unref(caps);
  }
  gst_harness_teardown(h);
}

ELEMENT_TEST(a_controller_drives_sigma) {
  GstHarness* h = harness_for("gaussblur");
  GstElement* blur = gst_harness_find_element(h, "gaussblur");
  control(blur, "sigma", 0.0, 10.0, GST_SECOND);
  gst_buffer_unref(pushed(h, "RGBA", subject, 0));
  fail_unless_equals_int(static_cast<int>(statistic(blur, "passed-through")), 1);
  gst_buffer_unref(pushed(h, "RGBA", subject, GST_SECOND / 2));
  gdouble sigma = 0.0;
  g_object_get(blur, "sigma", &sigma, nullptr);
  fail_unless_equals_float(sigma, 5.0);
  fail_unless_equals_int(static_cast<int>(statistic(blur, "frames")), 1);
  gst_object_unref(blur);
  gst_harness_teardown(h);
}

ELEMENT_TEST(not_a_number_changes_nothing) {
  GstElement* blur = gst_element_factory_make("gaussblur", nullptr);
  // GObject complains by itself; the value stays.
  ASSERT_WARNING(g_object_set(blur, "sigma", std::nan(""), nullptr));
  gdouble sigma = 0.0;
  g_object_get(blur, "sigma", &sigma, nullptr);
  fail_unless_equals_float(sigma, 2.0);
  gst_object_unref(blur);
}

ELEMENT_TEST(survives_flush_and_seek) {
  expect_survives_flush_and_seek(
      "videotestsrc num-buffers=100 ! video/x-raw,format=GRAY8 ! gaussblur method=box ! "
      "fakesink sync=false");
}

ELEMENT_TEST(frames_outlive_the_element) {
  GstHarness* h = harness_for("gaussblur");
  GstBuffer* out = pushed(h, "RGBA", subject);
  gst_harness_teardown(h);
  fail_unless(alpha_area(out, width, height) > 700);
  gst_buffer_unref(out);
}
