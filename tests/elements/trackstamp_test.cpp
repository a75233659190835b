// SPDX-License-Identifier: LGPL-2.1-or-later
// trackstamp: what it announces with each frame of a video is the track at the frame's time.
#include <gst/check/gstharness.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "camera_announced.h"
#include "element_test.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::int64_t ms = GST_MSECOND;
const Folder folder;

/// trackstamp fed by hand: frames of 64x48 of a live source that is 30 ms late, and poses.
struct Bench {
  explicit Bench(const char* rate, bool live_poses = true, GstClockTime late = 0)
      : element(gst_element_factory_make("trackstamp", nullptr)),
        harness(gst_harness_new_with_element(element, "sink", "src")),
        bus(gst_bus_new()),
        poses(element, live_poses, late) {
    gst_element_set_bus(element, bus);
    gst_harness_set_upstream_latency(harness, 30 * GST_MSECOND);
    log_cameras(element, log);
    gst_harness_set_src_caps_str(
        harness,
        (std::string("video/x-raw,format=GRAY8,width=64,height=48,framerate=") + rate).c_str());
    poses.begin();
  }
  ~Bench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
  }
  void close() { gst_harness_teardown(harness); }
  GstFlowReturn push(GstClockTime time) {
    GstBuffer* buffer = gst_harness_create_buffer(harness, 64 * 48);
    GST_BUFFER_PTS(buffer) = time;
    return gst_harness_push(harness, buffer);
  }

  GstElement* element;
  GstHarness* harness;
  GstBus* bus;
  PosePusher poses;
  CameraLog log;
};

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("trackstamp");
}

ELEMENT_TEST(test_each_frame_has_its_camera) {
  GstElement* pipeline = parse(
      "tracksrc location=" + record_motion(folder.file("a.pcap"), 7 * ms, 200) +
      " ! t.track videotestsrc num-buffers=30 ! video/x-raw,width=64,height=48,framerate=25/1 ! "
      "trackstamp name=t ! fakesink sync=false");
  GstElement* element = named(pipeline, "t");
  CameraLog log;
  log_cameras(element, log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  fail_unless_equals_int(log.frames.size(), 30);
  for (const Shown& frame : log.frames) {
    expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
    fail_unless(frame.camera.width == 64 && frame.camera.height == 48);
    fail_unless(std::abs(frame.camera.K[0][0] - 24.5 / 36.0 * 64) < 1e-9);
  }
  expect_lens(log);
  fail_unless_equals_uint64(statistic(element, "announcements"), 30);
  fail_unless_equals_uint64(statistic(element, "frames-tracked"), 30);
  // Both are sought together.
  gst_element_set_state(pipeline, GST_STATE_READY);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE);
  fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 600 * ms));
  gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE);
  fail_unless_equals_uint64(log.frames.back().time, 600 * ms);
  expect_place(log.frames.back().camera, {0.6, -3, 0.3});
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// A frame waits for the pose after it; frames of a tenth of a hertz leave a busy machine its time.
ELEMENT_TEST(test_live_frame_waits_for_its_pose) {
  Bench bench("1/10");
  bench.poses.push(0.0, 0);
  GstFlowReturn flow = GST_FLOW_ERROR;
  std::thread frame([&] { flow = bench.push(500 * ms); });
  g_usleep(50000);
  bench.poses.push(1.0, 1000 * ms);
  frame.join();
  fail_unless_equals_int(flow, GST_FLOW_OK);
  fail_unless_equals_int(bench.log.frames.size(), 1);
  expect_place(bench.log.frames[0].camera, {0.5, -3, 0.3});
  fail_unless_equals_uint64(statistic(bench.element, "frames-ahead"), 0);
  bench.close();
}

// A pose that nothing can be drawn with is left out; it does not end the stream.
ELEMENT_TEST(test_unusable_poses) {
  Bench bench("100/1");
  bench.poses.push(0.3, 0);
  fail_unless_equals_int(bench.push(0), GST_FLOW_OK);
  const auto lens = [](double focal, double sensor) {
    PoseMessage message;
    message.pose.focal_length_mm = focal;
    message.pose.sensor_width_mm = sensor;
    return pose_message_to_json(message);
  };
  int at = 0;
  for (const std::string& message : {lens(1e300, 1e-300), lens(1e-12, 36.0), lens(1e9, 36.0)}) {
    bench.poses.push(message, ++at * 20 * ms);
    fail_unless_equals_int(bench.push(at * 20 * ms), GST_FLOW_OK);
    expect_place(bench.log.frames.back().camera, {0.3, -3, 0.3});
    fail_unless_equals_uint64(statistic(bench.element, "poses-unusable"), at);
  }
  bench.poses.push(1e308, 100 * ms);
  bench.poses.push(-1e308, 120 * ms);
  fail_unless_equals_int(bench.push(110 * ms), GST_FLOW_OK);
  expect_place(bench.log.frames.back().camera, {0.3, -3, 0.3});
  bench.poses.push(0.7, 140 * ms);
  bench.push(140 * ms);
  expect_place(bench.log.frames.back().camera, {0.7, -3, 0.3});
  bench.close();
}

ELEMENT_TEST(test_pixel_aspect) {
  Bench bench("25/1, pixel-aspect-ratio=(fraction)16/15");
  bench.poses.push(0.3, 0);
  fail_unless_equals_int(bench.push(0), GST_FLOW_OK);
  const Camera& camera = bench.log.frames.back().camera;
  fail_unless(std::abs(camera.K[1][1] / camera.K[0][0] - 16.0 / 15.0) < 1e-12);
  bench.close();
}

// Where none comes, the frame goes on with the last one: a frame later, not more.
ELEMENT_TEST(test_live_frame_goes_on_without_a_pose) {
  Bench bench("100/1");
  fail_unless_equals_int(bench.push(0), GST_FLOW_OK);
  fail_unless_equals_int(bench.log.frames[0].camera.width, 0);  // nothing is known yet
  bench.poses.push(0.3, 0);
  fail_unless_equals_int(bench.push(20 * ms), GST_FLOW_OK);
  expect_place(bench.log.frames[1].camera, {0.3, -3, 0.3});
  fail_unless_equals_uint64(statistic(bench.element, "frames-ahead"), 1);
  fail_unless_equals_uint64(statistic(bench.element, "frames-untracked"), 1);
  // Lost, said once, and back.
  for (int i = 0; i < 3; ++i) bench.push((1100 + 10 * i) * ms);
  expect_place(bench.log.frames.back().camera, {0.3, -3, 0.3});
  fail_unless_equals_uint64(statistic(bench.element, "track-losses"), 1);
  fail_unless_equals_int(warnings_on(bench.bus).size(), 1);
  bench.poses.push(0.7, 1200 * ms);
  bench.push(1200 * ms);
  expect_place(bench.log.frames.back().camera, {0.7, -3, 0.3});
  fail_unless_equals_uint64(statistic(bench.element, "frames-tracked"), 2);
  bench.close();
}

ELEMENT_TEST(test_latency) {
  // Of the later of the two, and a frame more.
  const struct {
    bool live;
    GstClockTime late, sum;
  } cases[] = {{true, 100 * GST_MSECOND, 140 * GST_MSECOND},
               {true, 10 * GST_MSECOND, 70 * GST_MSECOND},
               {false, 0, 70 * GST_MSECOND}};
  for (const auto& expected : cases) {
    Bench bench("25/1", expected.live, expected.late);
    fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), expected.sum);
    bench.close();
  }
}

// A frame that has waited for something else is not kept any longer than until its own latency.
ELEMENT_TEST(test_waits_do_not_add_up) {
  constexpr GstClockTime hour = 3600 * GST_SECOND;
  Bench bench("25/1", true, hour);
  fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), hour + 40 * ms);
  gst_harness_set_time(bench.harness, hour + 41 * ms);
  bench.push(0);
  fail_unless_equals_int(bench.log.frames.size(), 1);
  bench.close();
}

ELEMENT_TEST(test_another_rate_is_another_latency) {
  Bench bench("25/1");
  bench.push(0);
  fail_unless_equals_int(latencies_told(bench.bus), 1);
  bench.push(40 * ms);
  fail_unless_equals_int(latencies_told(bench.bus), 0);
  gst_harness_set_src_caps_str(bench.harness,
                               "video/x-raw,format=GRAY8,width=64,height=48,framerate=50/1");
  bench.push(80 * ms);
  fail_unless_equals_int(latencies_told(bench.bus), 1);
  fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), 50 * ms);
  bench.close();
}

ELEMENT_TEST(test_scene_of_upstream_stays) {
  Bench bench("100/1");
  Announcement upstream;
  upstream.viewport = look_at({0, 1, 3}, {0, 1, 0}, 40, 64, 48);
  upstream.scene = "builtin:room";
  upstream.exposure = 0.5f;
  gst_harness_push_event(bench.harness, announcement_event(announcement_to_json(upstream)));
  bench.push(0);
  fail_unless(bench.log.frames[0].camera == upstream.viewport);
  bench.poses.push(0.3, 0);
  bench.push(10 * ms);
  expect_place(bench.log.frames[1].camera, {0.3, -3, 0.3});
  fail_unless(bench.log.announced.scene == "builtin:room");
  fail_unless(bench.log.announced.exposure == 0.5f);
  // The track does not tell the lens: the property does, live.
  g_object_set(bench.element, "field-of-view", 90.0, nullptr);
  bench.push(20 * ms);
  fail_unless(std::abs(bench.log.frames[2].camera.K[1][1] - 24.0) < 1e-9);
  // What is none is counted, and what was said before stays.
  gst_harness_push_event(bench.harness, announcement_event("{"));
  fail_unless_equals_uint64(statistic(bench.element, "announcements-unusable"), 1);
  bench.push(30 * ms);
  fail_unless(bench.log.announced.scene == "builtin:room");
  bench.close();
}

ELEMENT_TEST(test_flush_ends_the_waiting) {
  Bench bench("1/100");
  bench.poses.push(0.0, 0);
  GstFlowReturn flow = GST_FLOW_ERROR;
  std::thread frame([&] { flow = bench.push(500 * ms); });
  g_usleep(50000);
  gst_harness_push_event(bench.harness, gst_event_new_flush_start());
  frame.join();
  fail_unless_equals_int(flow, GST_FLOW_FLUSHING);
  gst_harness_push_event(bench.harness, gst_event_new_flush_stop(TRUE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(bench.harness, gst_event_new_segment(&segment));
  bench.poses.push(0.6, 600 * ms);
  fail_unless_equals_int(bench.push(300 * ms), GST_FLOW_OK);
  expect_place(bench.log.frames.back().camera, {0.3, -3, 0.3});
  // A frame without a time passes.
  fail_unless_equals_int(bench.push(GST_CLOCK_TIME_NONE), GST_FLOW_OK);
  fail_unless_equals_uint64(statistic(bench.element, "frames-untimed"), 1);
  bench.close();
}

// A seek goes to the track first: a frame of before comes among poses from the begin again.
ELEMENT_TEST(test_frame_of_before_a_seek) {
  for (const bool works : {true, false}) {
    GstElement* element = gst_element_factory_make("trackstamp", nullptr);
    GstHarness* harness = gst_harness_new_with_element(element, "sink", "src");
    CameraLog log;
    log_cameras(element, log);
    gst_harness_set_live(harness, FALSE);
    gst_harness_set_src_caps_str(harness,
                                 "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1");
    const auto push = [&](GstClockTime time) {
      GstBuffer* buffer = gst_harness_create_buffer(harness, 64 * 48);
      GST_BUFFER_PTS(buffer) = time;
      return gst_harness_push(harness, buffer);
    };
    PoseFile poses(element);
    poses.play();
    push(20 * GST_SECOND);
    expect_place(log.announced.viewport, {20, -3, 0.3});
    if (!works) {  // of the video; the frames then follow the track on
      GstPad* to = gst_element_get_static_pad(element, "sink");
      GstPad* from = gst_pad_get_peer(to);
      gst_pad_set_event_function(from, [](GstPad*, GstObject*, GstEvent* event) -> gboolean {
        gst_event_unref(event);
        return FALSE;
      });
      gst_object_unref(from);
      gst_object_unref(to);
    }
    GstFlowReturn flow = GST_FLOW_OK;
    std::thread before;
    poses.afterwards = [&] {
      before = std::thread([&] { flow = push(30 * GST_SECOND); });
      for (int i = 0; i < 500 && poses.pushed < 100; ++i) g_usleep(10000);
      g_usleep(100000);
      fail_unless(poses.pushed <= 102, "%d poses have come", poses.pushed.load());
    };
    GstEvent* seek = gst_event_new_seek(1.0, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                        GST_SEEK_TYPE_SET, 0, GST_SEEK_TYPE_NONE, -1);
    gst_harness_push_upstream_event(harness, gst_event_ref(seek));
    if (works) {
      gst_harness_push_event(harness, gst_event_new_flush_start());
      before.join();
      fail_unless_equals_int(flow, GST_FLOW_FLUSHING);
      GstEvent* flushed = gst_event_new_flush_stop(TRUE);
      gst_event_set_seqnum(flushed, gst_event_get_seqnum(seek));
      gst_harness_push_event(harness, flushed);
      GstSegment segment;
      gst_segment_init(&segment, GST_FORMAT_TIME);
      gst_harness_push_event(harness, gst_event_new_segment(&segment));
      // Another sink's copy of the seek, by which nothing is flushed again.
      poses.afterwards = [] {};
      gst_harness_push_upstream_event(harness, gst_event_ref(seek));
      for (int i = 0; i < 50; ++i) {
        push(static_cast<GstClockTime>(i) * 40 * ms);
        expect_place(log.announced.viewport, {0.04 * i, -3, 0.3});
      }
    } else {
      before.join();
      fail_unless_equals_int(flow, GST_FLOW_OK);
      expect_place(log.announced.viewport, {30, -3, 0.3});
    }
    gst_event_unref(seek);
    gst_harness_teardown(harness);
  }
}

// FreeD does not tell the lens's distortion, and OpenTrackIO need not.
ELEMENT_TEST(test_distortion_where_the_track_tells_none) {
  Bench bench("100/1");
  g_object_set(bench.element, "distortion-k1", -0.2, "distortion-p2", 0.01, nullptr);
  bench.poses.push(0.3, 0);
  bench.push(0);
  fail_unless(bench.log.announced.viewport.distortion ==
              std::vector<double>({-0.2, 0.0, 0.0, 0.01, 0.0}));
  PoseMessage message;
  message.pose.distortion = {0.1, 0.0, 0.0, 0.0};
  bench.poses.push(pose_message_to_json(message), 10 * ms);
  bench.push(10 * ms);
  fail_unless(bench.log.announced.viewport.distortion == message.pose.distortion);
  bench.close();
}

// With a scene beside the track a frame without a pose of its own keeps the tracked camera, too.
ELEMENT_TEST(test_tracked_camera_stays_beside_a_scene) {
  Bench bench("100/1");
  g_object_set(bench.element, "scene-wait", guint64{0}, nullptr);
  PosePusher scene(bench.element, true, 0, "scene");
  gst_util_set_object_arg(G_OBJECT(bench.element), "scene-match", "arrival");
  scene.begin();
  Announcement said;
  said.viewport = look_at({0, 1, 3}, {0, 1, 0}, 40, 64, 48);
  said.scene = "builtin:room";
  scene.push(announcement_to_json(said) + "\n", 0);
  bench.push(0);
  fail_unless(bench.log.announced.viewport == said.viewport);
  bench.poses.push(0.3, 10 * ms);
  bench.push(10 * ms);
  expect_place(bench.log.announced.viewport, {0.3, -3, 0.3});
  said.exposure = 0.5f;
  scene.push(announcement_to_json(said) + "\n", 15 * ms);
  bench.push(20 * ms);
  bench.push(GST_CLOCK_TIME_NONE);  // no time, and then no poses
  expect_place(bench.log.announced.viewport, {0.3, -3, 0.3});
  gst_pad_push_event(bench.poses.pad, gst_event_new_flush_start());
  gst_pad_push_event(bench.poses.pad, gst_event_new_flush_stop(TRUE));
  said.exposure = 0.25f;
  scene.push(announcement_to_json(said) + "\n", 25 * ms);
  bench.push(30 * ms);
  fail_unless(bench.log.announced.exposure == 0.25f);
  expect_place(bench.log.announced.viewport, {0.3, -3, 0.3});
  bench.close();
}

ELEMENT_TEST(test_what_is_no_video_is_refused) {
  const std::string said = run_to_end(
      "tracksrc port=0 num-buffers=1 ! t.track audiotestsrc num-buffers=1 ! trackstamp "
      "name=t ! fakesink");
  fail_unless(said.find("width and height") != std::string::npos, "%s", said.c_str());
}

// What is live and has never said anything holds up no frame of video that is not.
ELEMENT_TEST(test_silent_inputs_are_not_waited_for) {
  for (const char* pad : {"track", "scene", "depth"}) {
    GstElement* pipeline = parse(std::string("udpsrc port=0 ! t.") + pad +
                                 " videotestsrc num-buffers=3 ! trackstamp name=t "
                                 "scene-match=stream-time ! fakesink name=sink sync=false");
    GstElement* sink = named(pipeline, "sink");
    std::atomic<int> came{0};
    g_object_set(sink, "signal-handoffs", TRUE, nullptr);
    g_signal_connect(
        sink, "handoff",
        G_CALLBACK(+[](GstElement*, GstBuffer*, GstPad*, std::atomic<int>* count) { ++*count; }),
        &came);
    fail_if(gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE);
    for (int i = 0; i < 2000 && came < 3; ++i) g_usleep(10000);
    fail_unless(came == 3, "%s: %d frames came", pad, came.load());
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}

ELEMENT_TEST(test_states) {
  check_states("tracksrc location=" + record_motion(folder.file("states.pcap"), 10 * ms, 500) +
                   " ! t.track videotestsrc ! trackstamp name=t ! fakesink",
               20);
  check_states("tracksrc port=0 ! t.track videotestsrc is-live=true ! trackstamp name=t ! fakesink",
               6);
}
