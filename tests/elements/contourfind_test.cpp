// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/check/gstharness.h>

#include <cmath>
#include <numbers>

#include "elements/element_checks.h"
#include "elements/frames.h"
#include "elements/views.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr int width = 120;
constexpr int height = 90;
const Disk subject{50.3, 40.7, 25.0};

GstHarness* harness_for(const std::string& description, const char* format = "RGBA") {
  GstHarness* h = gst_harness_new_parse(description.c_str());
  gst_harness_set_src_caps(h, video_caps(format, width, height));
  return h;
}

GstBuffer* frame(const Disk& disk, GstClockTime pts = 0, const char* format = "RGBA") {
  GstCaps* caps = video_caps(format, width, height);
  GstBuffer* buffer = disk_frame(caps, disk, pts);
  gst_caps_unref(caps);
  return buffer;
}

ReadView viewed(GstHarness* h, GstBuffer* buffer) {
  return take_view(gst_harness_push_and_pull(h, buffer));
}

void send_qos(GstHarness* h, double proportion, GstClockTime time) {
  gst_harness_push_upstream_event(h,
                                  gst_event_new_qos(GST_QOS_TYPE_UNDERFLOW, proportion, 1, time));
}

}  // namespace

ELEMENT_TEST(says_what_it_is) {
  check_documented("contourfind");
}

ELEMENT_TEST(goes_up_and_down) {
  check_states(
      "videotestsrc num-buffers=30 pattern=ball background-color=0xff1ebe3c ! "
      "chromamatte ! gaussblur ! contourfind camera=cam0 ! fakesink");
}

ELEMENT_TEST(a_disk_becomes_a_view) {
  for (const char* format : {"RGBA", "GRAY8"}) {
    GstHarness* h = harness_for("contourfind camera=cam7 tolerance=0", format);
    GstBuffer* in = frame(subject, 3 * GST_SECOND, format);
    gst_buffer_ref(in);
    const ReadView read = viewed(h, in);
    const View& view = read.view;
    ck_assert_str_eq(view.camera.c_str(), "cam7");
    fail_unless_equals_int(view.width, width);
    fail_unless_equals_int(view.height, height);
    fail_unless_equals_int(static_cast<int>(view.contours.size()), 1);
    double worst = 0.0;
    for (const Vec2f& p : view.contours.ring(0)) {
      worst = std::max(worst, std::abs(std::hypot(p.x - subject.cx, p.y - subject.cy) - 25.0));
    }
    fail_unless(worst < 0.1, "%s: %g px off the circle", format, worst);
    fail_unless(signed_area(view.contours.ring(0)) > 0.0, "%s: runs the wrong way", format);

    // The region of interest: the pixels that x from 25.3 to 75.3 and y from 15.7 to 65.7 touch, as
    // they came.
    const Rectangle& roi = view.roi;
    fail_unless(roi == (Rectangle{25, 16, 51, 51}), "%s: %d,%d %dx%d", format, roi.x, roi.y,
                roi.width, roi.height);
    const int step = view.format == PixelFormat::rgba ? 4 : 1;
    fail_unless_equals_int(step, std::string(format) == "RGBA" ? 4 : 1);
    GstMapInfo map;
    gst_buffer_map(in, &map, GST_MAP_READ);
    for (int y = 0; y < roi.height; ++y) {
      fail_unless(std::equal(view.pixels.begin() + static_cast<std::ptrdiff_t>(view.stride) * y,
                             view.pixels.begin() + static_cast<std::ptrdiff_t>(view.stride) * y +
                                 roi.width * step,
                             map.data + ((roi.y + y) * width + roi.x) * step),
                  "%s: row %d", format, y);
    }
    gst_buffer_unmap(in, &map);
    gst_buffer_unref(in);
    gst_harness_teardown(h);
  }
}

// A picture's edges are as soft as they were keyed, whatever is blurred before contours are traced.
ELEMENT_TEST(views_keep_the_alpha_before_the_blur) {
  for (const char* format : {"RGBA", "GRAY8"})
    for (const char* blurs : {"gaussblur sigma=2", "gaussblur sigma=2 ! gaussblur sigma=1",
                              "gaussblur sigma=2 threshold=100"}) {
      GstHarness* h = harness_for(std::string(blurs) + " ! contourfind", format);
      GstBuffer* in = frame(subject, 0, format);
      std::vector<std::uint8_t> pixels(gst_buffer_get_size(in));
      gst_buffer_extract(in, 0, pixels.data(), pixels.size());
      const ReadView read = viewed(h, in);
      const View& view = read.view;
      const int step = view.format == PixelFormat::rgba ? 4 : 1;
      fail_if(view.roi.empty());
      for (int y = 0; y < view.roi.height; ++y)
        for (int x = 0; x < view.roi.width; ++x) {
          const int got = view.pixels[y * view.stride + step * x + step - 1];
          const int want = pixels[step * ((view.roi.y + y) * width + view.roi.x + x) + step - 1];
          fail_unless(got == want, "%s, %s: %d for %d at %d,%d", format, blurs, got, want, x, y);
        }
      gst_harness_teardown(h);
    }
}

ELEMENT_TEST(holes_run_the_other_way) {
  GstHarness* h = harness_for("contourfind tolerance=0.5", "GRAY8");
  GstBuffer* in = gst_buffer_new_allocate(nullptr, width * height, nullptr);
  GstMapInfo map;
  gst_buffer_map(in, &map, GST_MAP_WRITE);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double ring = disk_cover(x, y, 60, 45, 30) - disk_cover(x, y, 60, 45, 12);
      map.data[y * width + x] = static_cast<std::uint8_t>(std::lround(255 * ring));
    }
  }
  gst_buffer_unmap(in, &map);
  const ReadView read = viewed(h, in);
  fail_unless_equals_int(static_cast<int>(read.view.contours.size()), 2);
  const double outer = signed_area(read.view.contours.ring(0));
  const double hole = signed_area(read.view.contours.ring(1));
  fail_unless(std::abs(outer - std::numbers::pi * 900) < 20, "%g", outer);
  fail_unless(std::abs(hole + std::numbers::pi * 144) < 10, "%g", hole);
  gst_harness_teardown(h);
}

ELEMENT_TEST(no_foreground_makes_an_empty_view) {
  GstHarness* h = harness_for("contourfind camera=cam0");
  GstElement* find = gst_harness_find_element(h, "contourfind");
  const ReadView read = viewed(h, frame({50, 50, -5}, GST_SECOND));
  fail_unless(read.view.contours.empty());
  fail_unless(read.view.roi.empty());
  fail_unless(read.view.pixels.empty());
  fail_unless(read.view.format == PixelFormat::none);
  ck_assert_str_eq(read.view.camera.c_str(), "cam0");
  fail_unless_equals_int(read.view.width, width);
  fail_unless_equals_int(static_cast<int>(statistic(find, "empty")), 1);
  gst_object_unref(find);
  gst_harness_teardown(h);
}

ELEMENT_TEST(all_foreground_is_the_frame) {
  GstHarness* h = harness_for("contourfind");
  const ReadView read = viewed(h, frame({50, 50, 500}));
  fail_unless_equals_int(static_cast<int>(read.view.contours.size()), 1);
  fail_unless(std::abs(area_of(read.view.contours) - width * height) < 1e-3);
  fail_unless(read.view.roi == (Rectangle{0, 0, width, height}));
  gst_harness_teardown(h);
}

ELEMENT_TEST(tolerance_trades_vertices_for_error) {
  std::size_t before = 100000;
  for (const double tolerance : {0.0, 0.25, 0.5, 1.0, 2.0, 4.0}) {
    GstHarness* h = harness_for("contourfind tolerance=" + std::to_string(tolerance));
    const ReadView read = viewed(h, frame(subject));
    const auto ring = read.view.contours.ring(0);
    fail_unless(ring.size() < before, "tolerance %g: %u vertices", tolerance,
                (unsigned)ring.size());
    before = ring.size();
    // Every point of every edge, against the circle: within the tolerance and what tracing costs.
    for (std::size_t i = 0; i < ring.size(); ++i) {
      for (int k = 0; k < 16; ++k) {
        const Vec2f p = ring[i] + (ring[(i + 1) % ring.size()] - ring[i]) * (k / 16.0f);
        const double off = std::abs(std::hypot(p.x - subject.cx, p.y - subject.cy) - 25.0);
        fail_unless(off <= tolerance + 0.1, "tolerance %g: %g px off", tolerance, off);
      }
    }
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(small_rings_are_noise) {
  GstHarness* h = harness_for("contourfind min-area=100");
  GstElement* find = gst_harness_find_element(h, "contourfind");
  fail_unless(viewed(h, frame({50, 50, 4})).view.contours.empty());
  g_object_set(find, "min-area", 10.0, "tolerance", 0.2, nullptr);
  fail_if(viewed(h, frame({50, 50, 4}, GST_SECOND)).view.contours.empty());
  g_object_set(find, "min-edges", 1000, nullptr);
  fail_unless(viewed(h, frame({50, 50, 4}, 2 * GST_SECOND)).view.contours.empty());
  gst_object_unref(find);
  gst_harness_teardown(h);
}

ELEMENT_TEST(binary_traces_whole_pixels) {
  // The outline of the pixels encloses as many square pixels as there are pixels at or above half.
  GstHarness* h = harness_for("contourfind method=binary tolerance=0", "GRAY8");
  GstBuffer* in = frame(subject, 0, "GRAY8");
  const std::vector<std::uint8_t> levels = bytes_of(in);
  const auto pixels = std::count_if(levels.begin(), levels.end(), [](int v) { return v >= 128; });
  const ReadView read = viewed(h, in);
  fail_unless(std::abs(area_of(read.view.contours) - static_cast<double>(pixels)) < 0.01,
              "%g instead of %d", area_of(read.view.contours), (int)pixels);
  for (const Vec2f& p : read.view.contours.ring(0)) {
    fail_unless_equals_float(p.x - std::floor(p.x), 0.5f);
    fail_unless_equals_float(p.y - std::floor(p.y), 0.5f);
  }
  gst_harness_teardown(h);
}

/// A blurred disk shrinks by sigma^2 / (2 R); the correction takes that back.
ELEMENT_TEST(the_shift_of_the_blur_is_corrected) {
  const Disk disk{50.3, 40.7, 20.0};
  double radius[2];
  for (const int correct : {0, 1}) {
    GstHarness* h = harness_for("gaussblur sigma=2 ! contourfind tolerance=0 correct-curvature=" +
                                std::to_string(correct));
    const ReadView read = viewed(h, frame(disk));
    radius[correct] = std::sqrt(area_of(read.view.contours) / std::numbers::pi);
    gst_harness_teardown(h);
  }
  fail_unless(std::abs(radius[0] - 19.9) < 0.02, "%g", radius[0]);
  fail_unless(std::abs(radius[1] - 20.0) < 0.01, "%g", radius[1]);
}

ELEMENT_TEST(clocks_of_cameras_and_timecodes) {
  GstHarness* h = harness_for("contourfind");
  const auto seen = [&](const char* caps, GstClockTime time) {
    GstBuffer* in = frame(subject, GST_SECOND);
    GstCaps* reference = gst_caps_from_string(caps);
    gst_buffer_add_reference_timestamp_meta(in, reference, time, GST_CLOCK_TIME_NONE);
    gst_caps_unref(reference);
    return viewed(h, in).view;
  };
  constexpr GstClockTime now = 1700000000 * GST_SECOND;
  const auto expect = [](const View& view, CaptureClock clock, GstClockTime time) {
    fail_unless(view.clock == clock);
    fail_unless_equals_int64(view.capture_time, static_cast<gint64>(time));
    fail_unless(view.timecode == no_time);
  };
  expect(seen("timestamp/x-unix", now), CaptureClock::unix, now);
  expect(seen("timestamp/x-ndi-timestamp", now), CaptureClock::unix, now);
  expect(seen("timestamp/x-ntp", now + 2208988800 * GST_SECOND), CaptureClock::unix, now);
  expect(seen("timestamp/x-ptp, version=(int)2", now), CaptureClock::ptp, now);
  // A counter of one device's own: what came with the buffer counts.
  expect(seen("timestamp/x-decklink-stream", now), CaptureClock::arrival, GST_SECOND);

  GstBuffer* in = frame(subject, 2 * GST_SECOND);
  gst_buffer_add_video_time_code_meta_full(in, 25, 1, nullptr, GST_VIDEO_TIME_CODE_FLAGS_NONE, 10,
                                           20, 30, 5, 0);
  fail_unless_equals_int64(viewed(h, in).view.timecode,
                           ((10 * 60 + 20) * 60 + 30) * gint64{GST_SECOND} + 200 * GST_MSECOND);
  gst_harness_teardown(h);
}

ELEMENT_TEST(trigger_number_and_capture_time) {
  GstHarness* h = harness_for("contourfind name=cam3");
  gst_element_set_base_time(h->element, 1000 * GST_SECOND);
  // Base time is kept per element, not per bin.
  GstElement* find = gst_harness_find_element(h, "contourfind");
  gst_element_set_base_time(find, 1000 * GST_SECOND);

  GstBuffer* in = frame(subject, 2 * GST_SECOND);
  ReadView read = viewed(h, in);
  ck_assert_str_eq(read.view.camera.c_str(), "cam3");
  fail_unless(read.view.trigger == no_trigger);
  fail_unless_equals_int64(read.view.capture_time, 1002 * static_cast<std::int64_t>(GST_SECOND));

  in = frame(subject, 3 * GST_SECOND);
  // v4l2src and others count their own frames there: that is no trigger's number.
  GST_BUFFER_OFFSET(in) = 17;
  fail_unless(viewed(h, in).view.trigger == no_trigger);

  in = frame(subject, 4 * GST_SECOND);
  GST_BUFFER_OFFSET(in) = 18;
  GstCaps* reference = gst_caps_new_empty_simple("timestamp/x-polyhull-trigger");
  gst_buffer_add_reference_timestamp_meta(in, reference, 1234, 555 * GST_SECOND);
  read = viewed(h, in);
  fail_unless_equals_uint64(read.view.trigger, 1234);
  fail_unless_equals_int64(read.view.capture_time, 555 * static_cast<std::int64_t>(GST_SECOND));

  gst_util_set_object_arg(G_OBJECT(find), "trigger-from", "offset");
  in = frame(subject, 5 * GST_SECOND);
  GST_BUFFER_OFFSET(in) = 19;
  fail_unless_equals_uint64(viewed(h, in).view.trigger, 19);
  in = frame(subject, 5 * GST_SECOND);
  GST_BUFFER_OFFSET(in) = 20;
  gst_buffer_add_reference_timestamp_meta(in, reference, 1236, GST_CLOCK_TIME_NONE);
  fail_unless_equals_uint64(viewed(h, in).view.trigger, 1236);

  gst_util_set_object_arg(G_OBJECT(find), "trigger-from", "none");
  in = frame(subject, 6 * GST_SECOND);
  gst_buffer_add_reference_timestamp_meta(in, reference, 1235, GST_CLOCK_TIME_NONE);
  fail_unless(viewed(h, in).view.trigger == no_trigger);

  in = frame(subject);
  GST_BUFFER_PTS(in) = GST_CLOCK_TIME_NONE;
  fail_unless(viewed(h, in).view.capture_time == no_time);
  gst_caps_unref(reference);
  gst_object_unref(find);
  gst_harness_teardown(h);
}

ELEMENT_TEST(an_equal_frame_reuses_contours) {
  for (const char* blur : {"", "gaussblur sigma=2 ! "}) {
    GstHarness* on = harness_for(std::string(blur) + "contourfind camera=c");
    GstHarness* off = harness_for(std::string(blur) + "contourfind camera=c reuse=false");
    GstElement* find = gst_harness_find_element(on, "contourfind");
    const Disk moved{52.0, 40.7, 25.0};
    const Disk sequence[] = {subject, subject, moved, moved, moved, subject};
    for (int i = 0; i < 6; ++i) {
      const ReadView a = viewed(on, frame(sequence[i], i * GST_SECOND));
      const ReadView b = viewed(off, frame(sequence[i], i * GST_SECOND));
      fail_unless(a.bytes == b.bytes, "frame %d", i);
    }
    fail_unless_equals_int(static_cast<int>(statistic(find, "reused")), 3);

    // New settings are not answered with old contours.
    g_object_set(find, "tolerance", 5.0, nullptr);
    const ReadView coarse = viewed(on, frame(subject, 7 * GST_SECOND));
    const ReadView fine = viewed(off, frame(subject, 7 * GST_SECOND));
    fail_unless(coarse.view.contours.points.size() < fine.view.contours.points.size());
    gst_object_unref(find);
    gst_harness_teardown(on);
    gst_harness_teardown(off);
  }
}

/// Each setting counts at once, also while the picture stands still.
ELEMENT_TEST(settings_count_on_a_still_picture) {
  const auto still = [](int i) {
    GstBuffer* buffer = gst_buffer_new_allocate(nullptr, width * height, nullptr);
    GstMapInfo map;
    gst_buffer_map(buffer, &map, GST_MAP_WRITE);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const double cover = disk_cover(x, y, 40, 45, 30) - disk_cover(x, y, 40, 45, 8) +
                             disk_cover(x, y, 95, 45, 12);
        map.data[y * width + x] = static_cast<std::uint8_t>(std::lround(255 * cover));
      }
    gst_buffer_unmap(buffer, &map);
    GST_BUFFER_PTS(buffer) = i * GST_SECOND / 30;
    return buffer;
  };
  for (const auto& [name, value] : {std::pair{"tolerance", "3"},
                                    {"keep-largest", "1"},
                                    {"min-area", "600"},
                                    {"min-hole-area", "250"},
                                    {"min-edges", "12"},
                                    {"method", "binary"}}) {
    GstHarness* h = harness_for("contourfind tolerance=0.5", "GRAY8");
    GstElement* find = gst_harness_find_element(h, "contourfind");
    for (int i = 0; i < 3; ++i) {
      const ReadView read = viewed(h, still(i));
      fail_unless_equals_int(static_cast<int>(read.view.contours.size()), 3);
    }
    const Rings before = viewed(h, still(3)).view.contours;
    gst_util_set_object_arg(G_OBJECT(find), name, value);
    const Rings after = viewed(h, still(4)).view.contours;
    GstHarness* fresh = harness_for("contourfind tolerance=0.5", "GRAY8");
    GstElement* other = gst_harness_find_element(fresh, "contourfind");
    gst_util_set_object_arg(G_OBJECT(other), name, value);
    gst_object_unref(other);
    fail_unless(after == viewed(fresh, still(0)).view.contours, "%s", name);
    fail_if(after == before, "%s", name);
    gst_object_unref(find);
    gst_harness_teardown(fresh);
    gst_harness_teardown(h);
  }
}

ELEMENT_TEST(late_frames_coarsen_the_contours) {
  GstHarness* h = harness_for("contourfind adaptive=true tolerance=0.3");
  GstElement* find = gst_harness_find_element(h, "contourfind");
  const std::size_t fine = viewed(h, frame(subject)).view.contours.points.size();
  for (int i = 0; i < 120; ++i) send_qos(h, 1.5, i * GST_SECOND / 30);
  const std::size_t coarse = viewed(h, frame(subject, 4 * GST_SECOND)).view.contours.points.size();
  fail_unless(coarse < fine, "%u of %u vertices", (unsigned)coarse, (unsigned)fine);
  for (int i = 120; i < 3000; ++i) send_qos(h, 0.3, i * GST_SECOND / 30);
  fail_unless_equals_int(
      static_cast<int>(viewed(h, frame(subject, 100 * GST_SECOND)).view.contours.points.size()),
      static_cast<int>(fine));

  // At a third of the stream's rate the same load leaves time.
  g_object_set(find, "target-rate", 10.0, nullptr);
  for (int i = 3000; i < 3120; ++i) send_qos(h, 1.5, i * GST_SECOND / 30);
  fail_unless_equals_int(
      static_cast<int>(viewed(h, frame(subject, 104 * GST_SECOND)).view.contours.points.size()),
      static_cast<int>(fine));

  // Without adaptive QoS changes nothing.
  g_object_set(find, "adaptive", FALSE, "target-rate", 0.0, nullptr);
  for (int i = 3120; i < 3300; ++i) send_qos(h, 9.0, i * GST_SECOND / 30);
  fail_unless_equals_int(
      static_cast<int>(viewed(h, frame(subject, 110 * GST_SECOND)).view.contours.points.size()),
      static_cast<int>(fine));
  gst_object_unref(find);
  gst_harness_teardown(h);
}

ELEMENT_TEST(changes_size_and_format_in_the_stream) {
  GstHarness* h = gst_harness_new("contourfind");
  const struct {
    const char* format;
    int w, h;
  } rounds[] = {{"RGBA", 64, 48}, {"GRAY8", 33, 21}, {"RGBA", 1, 1}, {"GRAY8", 200, 40}};
  for (const auto& round : rounds) {
    GstCaps* caps = video_caps(round.format, round.w, round.h);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    GstBuffer* out = gst_harness_push_and_pull(
        h, disk_frame(caps, {round.w / 2.0, round.h / 2.0, round.h / 2.5}));
    const ReadView read = take_view(out);
    fail_unless_equals_int(read.view.width, round.w);
    fail_unless_equals_int(read.view.height, round.h);
    gst_caps_unref(caps);
  }
  gst_harness_teardown(h);
}

ELEMENT_TEST(views_keep_rate_times_and_pass_the_end) {
  GstHarness* h = gst_harness_new("contourfind");
  gst_harness_set_src_caps(h, video_caps("RGBA", width, height, 50));
  GstBuffer* out = gst_harness_push_and_pull(h, frame(subject, 5 * GST_SECOND));
  fail_unless_equals_uint64(GST_BUFFER_PTS(out), 5 * GST_SECOND);
  fail_unless_equals_uint64(GST_BUFFER_DURATION(out), GST_SECOND / 30);
  gst_buffer_unref(out);
  GstCaps* caps = gst_pad_get_current_caps(h->sinkpad);
  const GstStructure* structure = gst_caps_get_structure(caps, 0);
  ck_assert_str_eq(gst_structure_get_name(structure), "application/x-polyhull-view");
  gint n = 0, d = 0;
  fail_unless(gst_structure_get_fraction(structure, "framerate", &n, &d) && n == 50 && d == 1);
  gst_caps_unref(caps);
  fail_unless(gst_harness_push_event(h, gst_event_new_eos()));
  gst_harness_teardown(h);
}

ELEMENT_TEST(survives_flush_and_seek) {
  expect_survives_flush_and_seek(
      "videotestsrc num-buffers=100 pattern=ball background-color=0xff1ebe3c ! chromamatte ! "
      "contourfind ! fakesink sync=false");
}

ELEMENT_TEST(views_outlive_the_element) {
  GstHarness* h = harness_for("contourfind");
  GstBuffer* first = gst_harness_push_and_pull(h, frame(subject));
  const std::vector<std::uint8_t> bytes = bytes_of(first);
  // Memory is used again, but not while a view holds it.
  for (int i = 1; i < 20; ++i) viewed(h, frame({30.0 + i, 40.0, 20.0}, i * GST_SECOND));
  gst_harness_teardown(h);
  fail_unless(bytes_of(first) == bytes);
  gst_buffer_unref(first);
}

ELEMENT_TEST(a_frame_too_small_for_its_caps_is_an_error) {
  GstHarness* h = harness_for("contourfind");
  GstBuffer* in = gst_buffer_new_allocate(nullptr, 100, nullptr);
  fail_unless_equals_int(gst_harness_push(h, in), GST_FLOW_ERROR);
  gst_harness_teardown(h);
}
