// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gst/app/gstappsink.h>
#include <gst/check/gstharness.h>

#include <cmath>

#include "elements/element_checks.h"
#include "elements/keyed_disk.h"

using namespace polyhull::test;

ELEMENT_TEST(says_what_it_is) {
  check_documented("chromamatte");
}

ELEMENT_TEST(goes_up_and_down) {
  check_states(
      "videotestsrc num-buffers=30 pattern=ball background-color=0xff1ebe3c ! "
      "video/x-raw,format=NV12 ! chromamatte ! fakesink");
}

ELEMENT_TEST(keys_packed_formats_alike) {
  for (const char* format : {"RGBx", "BGRx", "RGBA", "BGRA", "RGB", "BGR"}) {
    GstHarness* h = harness_for("chromamatte", format);
    GstBuffer* out = pushed(h, format, subject);
    const double area = alpha_area(out, width, height);
    fail_unless(std::abs(area - disk_area) < 0.02 * disk_area, "%s: %g instead of %g", format, area,
                disk_area);
    for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
      const double cover = disk_cover(x, y, subject.cx, subject.cy, subject.radius);
      if (cover == 1.0 || cover == 0.0) fail_unless_equals_int(p[3], cover == 1.0 ? 255 : 0);
      if (cover == 1.0) {
        fail_unless(std::abs(p[0] - 200) <= 1 && std::abs(p[2] - 70) <= 1,
                    "%s: the subject's colour", format);
      }
    });
    gst_buffer_unref(out);
    gst_harness_teardown(h);
  }
}

/// Frames that videoconvert made of an RGB picture come back as that picture, whatever matrix and
/// range.
ELEMENT_TEST(honours_colorimetry) {
  const struct {
    const char* format;
    const char* colorimetry;
  } cases[] = {{"I420", "bt601"},   {"I420", "bt709"}, {"NV12", "bt709"},   {"NV12", "bt2020"},
               {"YUY2", "bt601"},   {"UYVY", "bt709"}, {"I420", "1:4:5:1"}, {"I420_10LE", "bt709"},
               {"NV12", "1:3:5:1"}, {"v210", "bt709"}};
  for (const auto& c : cases) {
    // 0xff + RRGGBB; the ball is the subject.
    GstElement* pipeline = parse(
        std::string("videotestsrc num-buffers=1 pattern=ball background-color=0xff28c83c "
                    "foreground-color=0xffc85a46 ! video/x-raw,format=RGBx,width=320,height=240 ! "
                    "videoconvert ! video/x-raw,format=") +
        c.format + ",colorimetry=" + c.colorimetry +
        " ! chromamatte spill=0 ! appsink name=sink sync=false");
    GstElement* sink = named(pipeline, "sink");
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink));
    fail_unless(sample != nullptr, "%s %s", c.format, c.colorimetry);
    int worst = 0;
    int inside = 0;
    for_each_pixel(gst_sample_get_buffer(sample), 320, 240, [&](int, int, const std::uint8_t* p) {
      if (p[3] != 255) return;
      // The ball's rim is mixed with the screen in the picture itself.
      if (p[0] < 195) return;
      ++inside;
      worst =
          std::max({worst, std::abs(p[0] - 0xc8), std::abs(p[1] - 0x5a), std::abs(p[2] - 0x46)});
    });
    fail_unless(inside > 500, "%s %s: %d pixels", c.format, c.colorimetry, inside);
    fail_unless(worst <= 6, "%s %s: colours differ by %d", c.format, c.colorimetry, worst);
    gst_sample_unref(sample);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}

ELEMENT_TEST(announces_the_transfer_of_the_camera) {
  GstHarness* h = gst_harness_new("chromamatte");
  gst_harness_set_src_caps_str(
      h, "video/x-raw,format=NV12,width=64,height=48,framerate=25/1,colorimetry=bt709");
  GstCaps* caps = video_caps("NV12", 64, 48);
  GstVideoInfo info;
  gst_video_info_from_caps(&info, caps);
  gst_caps_unref(caps);
  GstBuffer* in = gst_buffer_new_allocate(nullptr, GST_VIDEO_INFO_SIZE(&info), nullptr);
  gst_buffer_memset(in, 0, 128, -1);
  gst_buffer_unref(gst_harness_push_and_pull(h, in));
  GstCaps* out = gst_pad_get_current_caps(h->sinkpad);
  gst_video_info_from_caps(&info, out);
  fail_unless_equals_int(GST_VIDEO_INFO_FORMAT(&info), GST_VIDEO_FORMAT_RGBA);
  fail_unless_equals_int(info.colorimetry.matrix, GST_VIDEO_COLOR_MATRIX_RGB);
  fail_unless_equals_int(info.colorimetry.transfer, GST_VIDEO_TRANSFER_BT709);
  fail_unless_equals_int(info.fps_n, 25);
  gst_caps_unref(out);
  gst_harness_teardown(h);
}

ELEMENT_TEST(changes_size_and_format_in_the_stream) {
  GstHarness* h = gst_harness_new("chromamatte");
  const struct {
    const char* format;
    int w, h;
  } rounds[] = {
      {"RGBx", 64, 48}, {"BGR", 33, 21}, {"RGBA", 200, 7}, {"BGRx", 1, 1}, {"RGB", 64, 48}};
  for (const auto& round : rounds) {
    GstCaps* caps = video_caps(round.format, round.w, round.h);
    gst_harness_set_src_caps(h, gst_caps_ref(caps));
    GstBuffer* out = gst_harness_push_and_pull(
        h, disk_frame(caps, {round.w / 2.0, round.h / 2.0, round.h / 3.0}));
    fail_unless(out != nullptr);
    fail_unless_equals_int(static_cast<int>(gst_buffer_get_size(out)), round.w * round.h * 4);
    gst_buffer_unref(out);
    gst_caps_unref(caps);
  }
  gst_harness_teardown(h);
}

ELEMENT_TEST(survives_flush_and_seek) {
  GstElement* pipeline = parse(
      "videotestsrc num-buffers=200 pattern=ball background-color=0xff1ebe3c ! "
      "video/x-raw,format=I420 ! chromamatte name=key ! fakesink name=sink sync=false");
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                         GST_STATE_CHANGE_SUCCESS);
  for (int i = 0; i < 10; ++i) {
    fail_unless(gst_element_seek_simple(
        pipeline, GST_FORMAT_TIME,
        static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        (i % 5) * 500 * GST_MSECOND));
    fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                           GST_STATE_CHANGE_SUCCESS);
  }
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  stop(pipeline);
}

ELEMENT_TEST(shows_the_operator_what_it_does) {
  for (const char* view : {"matte", "status", "spill"}) {
    GstHarness* h = harness_for(std::string("chromamatte view=") + view);
    GstBuffer* out = pushed(h, "RGBx", subject);
    for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
      fail_unless_equals_int(p[3], 255);
      const double cover = disk_cover(x, y, subject.cx, subject.cy, subject.radius);
      if (std::string(view) == "spill" || (cover != 0.0 && cover != 1.0)) return;
      for (int i = 0; i < 3; ++i) fail_unless_equals_int(p[i], cover == 1.0 ? 255 : 0);
    });
    gst_buffer_unref(out);
    gst_harness_teardown(h);
  }
}

/// Four pictures in one of the same size, and how clear the matte is.
ELEMENT_TEST(shows_all_views_in_one) {
  GstHarness* h = gst_harness_new("chromamatte");
  gst_util_set_object_arg(G_OBJECT(h->element), "view", "split");
  gst_harness_set_src_caps(h, video_caps("RGBx", width, height));
  GstBuffer* out = pushed(h, "RGBx", subject);
  int black = 0, white = 0;
  for_each_pixel(out, width, height, [&](int x, int y, const std::uint8_t* p) {
    fail_unless_equals_int(p[3], 255);
    if (x < width / 2 || y >= height / 2) return;  // the matte is above, to the right
    black += p[0] == 0;
    white += p[0] == 255;
  });
  fail_unless(std::abs(4.0 * white - disk_area) < 0.2 * disk_area, "%d white", white);
  fail_unless(black + white > 0.9 * width * height / 4);
  fail_unless(figure(h->element, "score") == 100.0);
  fail_unless(
      std::abs(figure(h->element, "subject-percent") - 100.0 * disk_area / (width * height)) < 1.0);
  fail_unless(figure(h->element, "doubtful-screen-percent") == 0.0);
  fail_unless(figure(h->element, "doubtful-subject-percent") == 0.0);
  gst_buffer_unref(out);
  gst_harness_teardown(h);
}

ELEMENT_TEST(frames_outlive_the_element) {
  GstHarness* h = harness_for("chromamatte");
  GstBuffer* out = pushed(h, "RGBx", subject);
  gst_harness_teardown(h);
  fail_unless(alpha_area(out, width, height) > 900);
  gst_buffer_unref(out);
}

ELEMENT_TEST(trigger_numbers_and_times_pass) {
  GstHarness* h = harness_for("chromamatte");
  GstCaps* caps = video_caps("RGBx", width, height);
  GstBuffer* in = disk_frame(caps, subject, 7 * GST_SECOND);
  GST_BUFFER_OFFSET(in) = 42;
  GstCaps* reference = gst_caps_new_empty_simple("timestamp/x-polyhull-trigger");
  gst_buffer_add_reference_timestamp_meta(in, reference, 99, GST_CLOCK_TIME_NONE);
  GstBuffer* out = gst_harness_push_and_pull(h, in);
  fail_unless_equals_uint64(GST_BUFFER_OFFSET(out), 42);
  fail_unless_equals_uint64(GST_BUFFER_PTS(out), 7 * GST_SECOND);
  const auto* meta = gst_buffer_get_reference_timestamp_meta(out, reference);
  fail_unless(meta != nullptr && meta->timestamp == 99);
  gst_buffer_unref(out);
  gst_caps_unref(reference);
  gst_caps_unref(caps);
  gst_harness_teardown(h);
}

/// What a user sees who asks for a colour that has no name: what the property takes instead.
ELEMENT_TEST(an_unknown_key_is_answered_with_the_known_ones) {
  std::string said;
  const guint handler = g_log_set_handler(
      nullptr, G_LOG_LEVEL_WARNING,
      [](const gchar*, GLogLevelFlags, const gchar* text, gpointer to) {
        *static_cast<std::string*>(to) += text;
      },
      &said);
  GError* error = nullptr;
  GstElement* made = gst_parse_launch("chromamatte key=yellow", &error);
  fail_unless(error != nullptr);
  g_clear_error(&error);
  if (made != nullptr) gst_object_unref(made);
  for (const char* part : {"key", "\"yellow\"", "green", "blue", "colour", "key-colour", "auto"})
    fail_unless(said.find(part) != std::string::npos, "%s not in: %s", part, said.c_str());
  said.clear();
  made = gst_parse_launch("chromamatte key=3 method=difference view=Nothing", &error);
  fail_unless(error != nullptr);
  g_clear_error(&error);
  if (made != nullptr) gst_object_unref(made);
  fail_unless(said.find("view") != std::string::npos && said.find("status") != std::string::npos &&
                  said.find("auto") == std::string::npos,
              "%s", said.c_str());
  g_log_remove_handler(nullptr, handler);

  // Nicks, names and numbers are taken; values come back as their nicks.
  made = gst_parse_launch("chromamatte key=3 method=difference view=status", nullptr);
  GValue key = G_VALUE_INIT;
  g_value_init(&key, g_type_from_name("PolyhullKeyColour"));
  g_object_get_property(G_OBJECT(made), "key", &key);
  gchar* text = gst_value_serialize(&key);
  fail_unless_equals_string(text, "auto");
  g_free(text);
  fail_unless(gst_value_deserialize(&key, "Blue screen"));
  fail_unless_equals_int(g_value_get_enum(&key), 1);
  fail_unless(gst_value_compare(&key, &key) == GST_VALUE_EQUAL);
  g_value_unset(&key);
  gst_object_unref(made);
}
