// SPDX-License-Identifier: LGPL-2.1-or-later
// composite as a member of a stream: size changes, seeks, latency, live sources, no display.
#include <gst/check/gstharness.h>
#include <gst/video/video.h>

#include <cstring>
#include <vector>

#include "element_checks.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

std::string caps_of(int width, int height, const char* format = "RGBA") {
  return std::string("video/x-raw,format=") + format + ",width=" + std::to_string(width) +
         ",height=" + std::to_string(height) + ",framerate=25/1";
}

GstBuffer* frame(int width, int height, int number) {
  const gsize size = 4 * static_cast<gsize>(width) * static_cast<gsize>(height);
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, size, nullptr);
  gst_buffer_memset(buffer, 0, 90, size);
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(number) * 40 * GST_MSECOND;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

}  // namespace

ELEMENT_TEST(takes_a_new_size_in_the_stream) {
  GstElement* element = gst_element_factory_make("composite", nullptr);
  GstHarness* harness = gst_harness_new_with_element(element, "background", "src");
  const struct {
    int width, height;
  } sizes[] = {{320, 180}, {64, 48}, {641, 363}, {1, 1}, {320, 180}};
  int number = 0;
  for (const auto& size : sizes) {
    gst_harness_set_src_caps_str(harness, caps_of(size.width, size.height).c_str());
    for (int i = 0; i < 2; ++i) {
      gst_harness_push(harness, frame(size.width, size.height, number++));
      GstBuffer* out = gst_harness_pull(harness);
      fail_unless(out != nullptr);
      GstCaps* caps = gst_pad_get_current_caps(harness->sinkpad);
      GstVideoInfo info;
      fail_unless(gst_video_info_from_caps(&info, caps));
      gst_caps_unref(caps);
      fail_unless_equals_int(GST_VIDEO_INFO_WIDTH(&info), size.width);
      fail_unless_equals_int(GST_VIDEO_INFO_HEIGHT(&info), size.height);
      GstVideoFrame video;
      fail_unless(gst_video_frame_map(&video, &info, out, GST_MAP_READ));
      const auto* pixel = static_cast<const guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&video, 0));
      fail_unless_equals_int(pixel[1], 90);  // no subject: the background as it came
      gst_video_frame_unmap(&video);
      gst_buffer_unref(out);
    }
  }
  gst_harness_teardown(harness);
  gst_object_unref(element);
}

ELEMENT_TEST(survives_seeks) {
  GstElement* pipeline = test::parse("videotestsrc num-buffers=100 ! " + caps_of(160, 90) +
                                     " ! mix.background composite name=mix ! fakesink sync=false");
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                         GST_STATE_CHANGE_SUCCESS);
  for (int i = 0; i < 8; ++i) {
    const GstClockTime to = static_cast<GstClockTime>(i % 3) * GST_SECOND;
    fail_unless(gst_element_seek_simple(
        pipeline, GST_FORMAT_TIME,
        static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH | GST_SEEK_FLAG_ACCURATE),
        static_cast<gint64>(to)));
    fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                           GST_STATE_CHANGE_SUCCESS);
    gint64 position = -1;
    fail_unless(gst_element_query_position(pipeline, GST_FORMAT_TIME, &position));
    fail_unless(position >= static_cast<gint64>(to) &&
                    position <= static_cast<gint64>(to + 80 * GST_MSECOND),
                "sought %" G_GUINT64_FORMAT ", at %" G_GINT64_FORMAT, to, position);
  }
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  test::check_ended(test::wait_for_end(pipeline));
  stop(pipeline);
}

ELEMENT_TEST(tells_the_latency_of_a_live_stream) {
  GstElement* pipeline = test::parse(
      "videotestsrc is-live=true num-buffers=20 ! " + caps_of(160, 90) +
      " ! mix.background composite name=mix latency=50000000 ! fakesink name=sink sync=true");
  fail_unless_equals_int(gst_element_set_state(pipeline, GST_STATE_PAUSED),
                         GST_STATE_CHANGE_NO_PREROLL);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND),
                         GST_STATE_CHANGE_SUCCESS);
  GstQuery* query = gst_query_new_latency();
  fail_unless(gst_element_query(pipeline, query));
  gboolean live = FALSE;
  GstClockTime least = 0;
  gst_query_parse_latency(query, &live, &least, nullptr);
  gst_query_unref(query);
  fail_unless(live);
  // A frame's duration of the source, and what is waited for late meshes.
  fail_unless(least >= 50 * GST_MSECOND && least <= 200 * GST_MSECOND, "%" G_GUINT64_FORMAT " ns",
              least);
  test::check_ended(test::wait_for_end(pipeline));
  stop(pipeline);
}

namespace {

struct Told {
  int frames = 0;                // that have arrived
  std::vector<int> frames_then;  // at each signal
};

}  // namespace

// Each set brings one signal, when the first frame that shows it has gone, however many show it.
ELEMENT_TEST(tells_of_each_set_once) {
  std::string line =
      "composite name=mix ! fakesink name=sink sync=false signal-handoffs=true "
      "videotestsrc num-buffers=12 ! " +
      caps_of(160, 90) + " ! mix.background hullbuild name=hull ! mix.mesh_0";
  for (int i = 0; i < 4; ++i)
    line += " rigtestsrc num-buffers=4 camera=cam" + std::to_string(i) +
            " ! video/x-raw,framerate=25/3 ! silhouette camera=cam" + std::to_string(i) +
            " ! hull.sink_" + std::to_string(i);
  GstElement* pipeline = test::parse(line);
  GstElement* mix = named(pipeline, "mix");
  GstElement* sink = named(pipeline, "sink");
  Told told;
  g_signal_connect(sink, "handoff",
                   G_CALLBACK(+[](GstElement*, GstBuffer*, GstPad*, gpointer data) {
                     ++static_cast<Told*>(data)->frames;
                   }),
                   &told);
  g_signal_connect(mix, "composited", G_CALLBACK(+[](GstElement*, guint64 trigger, gpointer data) {
                     auto* t = static_cast<Told*>(data);
                     // rigtestsrc gives frames their numbers.
                     fail_unless_equals_uint64(trigger, t->frames_then.size());
                     t->frames_then.push_back(t->frames);
                   }),
                   &told);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  test::check_ended(test::wait_for_end(pipeline));
  gst_element_set_state(pipeline, GST_STATE_NULL);
  fail_unless_equals_int(told.frames, 12);
  const std::vector<int> expected{1, 4, 7, 10};
  fail_unless(told.frames_then == expected);
  gst_object_unref(pipeline);
}

ELEMENT_TEST(draws_without_a_display) {
  const gchar* fork = g_getenv("CK_FORK");
  if (fork && g_str_equal(fork, "no")) return;  // GStreamer's choice is made once in a process
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "GST_GL_PLATFORM", "GST_GL_WINDOW"})
    g_unsetenv(name);
  test::check_ended(test::run_to_end("videotestsrc num-buffers=3 ! " + caps_of(160, 90) +
                                     " ! mix.background composite name=mix ! fakesink"));
}

/// An input that keeps the others waiting is named, once.
ELEMENT_TEST(says_which_input_it_waits_for) {
  GstElement* pipeline = test::parse(
      "videotestsrc ! video/x-raw,format=RGBA,width=64,height=48 ! composite.background "
      "composite name=composite ! fakesink");
  GstElement* composite = named(pipeline, "composite");
  GstPad* pad = gst_element_request_pad_simple(composite, "mesh_7");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(bus, 8 * GST_SECOND, GST_MESSAGE_WARNING);
  fail_unless(message != nullptr, "nothing was said");
  GError* warning = nullptr;
  gst_message_parse_warning(message, &warning, nullptr);
  fail_unless(strstr(warning->message, "composite waits for its input mesh_7") &&
                  strstr(warning->message, "not linked"),
              "%s", warning->message);
  g_clear_error(&warning);
  gst_message_unref(message);
  fail_unless(gst_bus_timed_pop_filtered(bus, 2 * GST_SECOND, GST_MESSAGE_WARNING) == nullptr);
  gst_object_unref(bus);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_element_release_request_pad(composite, pad);
  gst_object_unref(pad);
  gst_object_unref(pipeline);
}
