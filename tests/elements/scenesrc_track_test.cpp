// SPDX-License-Identifier: LGPL-2.1-or-later
// scenesrc with a tracked camera: what it announces with each frame is the track at the frame's time.
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <random>
#include <vector>

#include "camera_announced.h"
#include "element_test.h"
#include "small_scene.h"
#include "support/folder.h"
#include "support/run_kind.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::int64_t ms = GST_MSECOND;
const Folder folder;

std::string scenesrc(const std::string& properties, const char* rate = "25/1") {
  static const std::string scene = write_small_scene(folder.file("small.glb"));
  return " scenesrc name=src light-spacing=0.2 eye-x=5 scene=" + scene + " " + properties +
         " ! video/x-raw,format=RGBA,width=32,height=24,framerate=" + rate + " ";
}

void log_source(GstElement* pipeline, CameraLog& log) {
  log_cameras(named(pipeline, "src"), log);
}

std::string moving(const char* name, std::int64_t step, int count) {
  return record_motion(folder.file(name), step, count);
}

void play(GstElement* pipeline) {
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline, 200 * GST_SECOND));
}

guint64 counter(GstElement* pipeline, const char* element, const char* name) {
  return statistic(named(pipeline, element), name);
}

}  // namespace

ELEMENT_TEST(test_random_poses_are_announced) {
  const int count = sanitized() ? 100 : 1000;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> metre(-50, 50), turn(-180, 180);
  std::vector<Vec3> places, angles;
  for (int i = 0; i < count; ++i) {
    places.push_back({metre(random), metre(random), metre(random)});
    angles.push_back({turn(random), turn(random) / 2, turn(random)});
  }
  GstElement* pipeline = parse(
      "tracksrc location=" + record_track(folder.file("random.pcap"), 40 * ms, places, angles) +
      " ! src.track" + scenesrc("num-buffers=" + std::to_string(count)) + " ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  play(pipeline);
  fail_unless_equals_int(log.frames.size(), count);
  for (std::size_t i = 0; i < log.frames.size(); ++i) {
    const Camera& camera = log.frames[i].camera;
    expect_place(camera, places[i]);
    // Rows of R: right, down, forward in the scene's y-up world.
    const Mat3 axes = axes_of_angles(angles[i].x, angles[i].y, angles[i].z);
    const Mat3 looks = glm::transpose(camera.R);
    fail_unless(glm::length(Vec3(looks[2].x, -looks[2].z, looks[2].y) - axes[1]) < 1e-9);
    fail_unless(glm::length(Vec3(looks[0].x, -looks[0].z, looks[0].y) - axes[0]) < 1e-9);
    // The lens that the packets tell: 24.5 mm before 36 mm.
    fail_unless(std::abs(camera.K[0][0] - 24.5 / 36.0 * 32) < 1e-9);
  }
  expect_lens(log);
  fail_unless_equals_uint64(counter(pipeline, "src", "frames-tracked"), count);
  stop(pipeline);
}

// Frames between poses, and the picture where the announced camera sees the box.
ELEMENT_TEST(test_between_poses_and_in_register) {
  GstElement* pipeline =
      parse("tracksrc location=" + moving("moving.pcap", 7 * ms, 200) + " ! src.track" +
            scenesrc("num-buffers=30") + " ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  play(pipeline);
  fail_unless_equals_int(log.frames.size(), 30);
  int seen = 0;
  for (const Shown& frame : log.frames) {
    expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
    const Vec2 at = *frame.camera.project_ideal({0, 0.3, 0.3});
    if (at.x < 1 || at.x > 30) continue;
    const std::uint8_t* pixel = &frame.bytes[4 * (32 * static_cast<std::size_t>(std::lround(at.y)) +
                                                  static_cast<std::size_t>(std::lround(at.x)))];
    fail_unless(pixel[0] > 2 * pixel[2] && pixel[0] > 2 * pixel[1], "the box's face is red");
    ++seen;
  }
  fail_unless(seen > 20);
  stop(pipeline);
}

ELEMENT_TEST(test_composite_hears_of_each_frame) {
  GstElement* pipeline =
      parse("tracksrc location=" + moving("composite.pcap", 10 * ms, 100) + " ! src.track" +
            scenesrc("num-buffers=10") +
            " ! c.background composite name=c backend=processor ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  play(pipeline);
  fail_unless_equals_int(log.frames.size(), 10);
  fail_unless_equals_uint64(counter(pipeline, "c", "announcements"), 10);
  fail_unless_equals_uint64(counter(pipeline, "c", "frames"), 10);
  stop(pipeline);
}

ELEMENT_TEST(test_seek_takes_the_track_along) {
  GstElement* pipeline = parse("tracksrc location=" + moving("seek.pcap", 10 * ms, 300) +
                               " ! src.track" + scenesrc("") + " ! fakesink name=sink sync=false");
  CameraLog log;
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE);
  log_source(pipeline, log);
  for (const double to : {1.2, 0.4, 2.0, 0.0}) {
    fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                                        static_cast<gint64>(to * 1e9)));
    gst_element_get_state(pipeline, nullptr, nullptr, GST_CLOCK_TIME_NONE);
    fail_unless_equals_uint64(log.frames.back().time, static_cast<GstClockTime>(to * 1e9));
    expect_place(log.frames.back().camera, {to, -3, 0.3});
  }
  stop(pipeline);
}

// A seek goes to the track first: frames of before come among poses from the begin again.
ELEMENT_TEST(test_frames_of_before_a_seek) {
  GstElement* pipeline = parse(scenesrc("") + " ! fakesink name=sink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  {
    PoseFile poses(named(pipeline, "src"));
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    poses.play();
    for (int i = 0; i < 3000 && poses.pushed < 2000; ++i) g_usleep(10000);
    poses.afterwards = [&] {
      for (int i = 0; i < 500 && poses.pushed < 100; ++i) g_usleep(10000);
      g_usleep(200000);
      fail_unless(poses.pushed <= 102, "%d poses have come", poses.pushed.load());
    };
    fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, 0));
    for (int i = 0; i < 3000 && poses.pushed < 300; ++i) g_usleep(10000);
    gst_element_set_state(pipeline, GST_STATE_NULL);
  }
  log.frames.pop_back();  // whose announcement the end may have cut off
  std::size_t begin = log.frames.size() - 1;
  while (log.frames[begin].time > 0) --begin;
  fail_unless(begin > 0 && log.frames.size() - begin > 40);
  for (std::size_t i = begin; i < log.frames.size(); ++i)
    expect_place(log.frames[i].camera, {1e-9 * static_cast<double>(log.frames[i].time), -3, 0.3});
  gst_object_unref(pipeline);
}

// FreeD tells no distortion of the lens: the properties' holds.
ELEMENT_TEST(test_distortion_where_the_track_tells_none) {
  GstElement* pipeline =
      parse("tracksrc location=" + moving("plain.pcap", 10 * ms, 10) + " ! src.track" +
            scenesrc("num-buffers=1 distortion-k1=-0.1") + " ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  play(pipeline);
  fail_unless(log.frames.at(0).camera.distortion == std::vector<double>({-0.1, 0, 0, 0, 0}));
  stop(pipeline);
}

// A PTZ head's encoders move the viewport's lens by way of a lens file, up to composite.
ELEMENT_TEST(test_encoders_move_the_lens) {
  {
    PacketRecorder recorder(folder.file("ptz.pcap"), 55555);
    for (unsigned i = 0; i <= 10; ++i)
      recorder.write({40 * ms * i, 0x7F000001, 4000,
                      track_examples::freed(1, {0, 0, 0}, {0, -3, 0.3}, 100 * i, 1000 - 100 * i)});
    std::ofstream(folder.file("lens.txt")) << "zoom focal_length_mm k1 entrance_pupil_m\n"
                                              "0 10 -0.1 0.0\n1000 30 0.1 0.2\n"
                                              "focus focus_distance_m\n0 1\n1000 inf\n";
  }
  GstElement* pipeline =
      parse("tracksrc sensor-width=12 location=" + folder.file("ptz.pcap") +
            " lens-file=" + folder.file("lens.txt") + " ! src.track" + scenesrc("num-buffers=11") +
            " ! c.background composite name=c backend=processor ! fakesink "
            "sync=false");
  CameraLog log;
  log_source(pipeline, log);
  play(pipeline);
  fail_unless_equals_int(log.frames.size(), 11);
  for (std::size_t i = 0; i < log.frames.size(); ++i) {
    const Camera& camera = log.frames[i].camera;
    const double zoom = 0.1 * static_cast<double>(i);
    fail_unless(std::abs(camera.K[0][0] - (10 + 20 * zoom) / 12 * 32) < 1e-6);
    fail_unless(std::abs(camera.distortion.at(0) - (-0.1 + 0.2 * zoom)) < 1e-9);
    expect_place(camera, {0, -3 + 0.2 * zoom, 0.3});
  }
  fail_unless(std::abs(log.announced.focus_distance - 1.0) < 1e-9);
  fail_unless_equals_uint64(counter(pipeline, "c", "announcements"), 11);
  stop(pipeline);
}

// A live track that has never said anything holds up no frame for longer than a second.
ELEMENT_TEST(test_silent_track_is_not_waited_for) {
  GstElement* pipeline =
      parse("tracksrc port=0 ! src.track" + scenesrc("num-buffers=5") + " ! fakesink sync=false");
  play(pipeline);
  fail_unless_equals_uint64(counter(pipeline, "src", "frames-untracked"), 5);
  stop(pipeline);
}

// After the track's end its last pose stands; that is counted, and said once.
ELEMENT_TEST(test_lost_track_keeps_its_last_pose) {
  GstElement* pipeline =
      parse("tracksrc location=" + moving("lost.pcap", 10 * ms, 51) + " ! src.track" +
            scenesrc("num-buffers=75") + " ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  GstBus* bus = gst_element_get_bus(pipeline);
  int warnings = 0;
  for (bool ended = false; !ended;) {
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, 100 * GST_SECOND,
        static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_WARNING | GST_MESSAGE_ERROR));
    fail_unless(message != nullptr && GST_MESSAGE_TYPE(message) != GST_MESSAGE_ERROR);
    warnings += GST_MESSAGE_TYPE(message) == GST_MESSAGE_WARNING;
    ended = GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS;
    gst_message_unref(message);
  }
  gst_object_unref(bus);
  fail_unless_equals_int(log.frames.size(), 75);
  for (int i = 0; i < 75; ++i) expect_place(log.frames[i].camera, {std::min(.04 * i, .5), -3, 0.3});
  // Up to 1.5 s: frames 0 to 37.
  fail_unless_equals_uint64(counter(pipeline, "src", "frames-tracked"), 38);
  fail_unless_equals_uint64(counter(pipeline, "src", "frames-untracked"), 37);
  fail_unless_equals_uint64(counter(pipeline, "src", "track-losses"), 1);
  fail_unless_equals_int(warnings, 1);
  stop(pipeline);
}

// Live: a pose that came before the frame before left is shown at the latest in this one; a silence
// is survived.
ELEMENT_TEST(test_live_is_a_frame_late_at_most) {
  GstElement* pipeline = parse(scenesrc("is-live=true", "20/1") + " ! fakesink sync=false");
  PosePusher poses(named(pipeline, "src"), true);
  static std::atomic<guint64> sent;  // the last pose that was taken, in millimetres
  sent = 0;
  struct Live {
    CameraLog log;
    std::vector<guint64> sent;  // when each frame left
  } live;
  log_source(pipeline, live.log);
  GstPad* pad = gst_element_get_static_pad(poses.element, "src");
  gst_pad_add_probe(
      pad, GST_PAD_PROBE_TYPE_BUFFER,
      [](GstPad*, GstPadProbeInfo*, gpointer data) {
        static_cast<Live*>(data)->sent.push_back(sent.load());
        return GST_PAD_PROBE_OK;
      },
      &live, nullptr);
  gst_object_unref(pad);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  poses.begin();
  const auto now = [&] { return gst_element_get_current_running_time(pipeline); };
  const auto track_for = [&](GstClockTime time) {
    for (const GstClockTime end = now() + time; now() < end; g_usleep(5000)) {
      const GstClockTime at = now();
      fail_unless_equals_int(poses.push(1e-9 * static_cast<double>(at), at), GST_FLOW_OK);
      sent = at / GST_MSECOND;
    }
  };
  const auto tracked = [&] { return statistic(poses.element, "frames-tracked"); };
  for (int i = 0; i < 60 && tracked() < 10; ++i) track_for(500 * GST_MSECOND);
  fail_unless(tracked() >= 10);
  for (int i = 0; i < 3000 && statistic(poses.element, "track-losses") == 0; ++i) g_usleep(10000);
  fail_unless_equals_uint64(statistic(poses.element, "track-losses"), 1);
  const guint64 before = tracked();
  for (int i = 0; i < 60 && tracked() < before + 5; ++i) track_for(500 * GST_MSECOND);
  fail_unless(tracked() >= before + 5);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  fail_unless_equals_int(live.sent.size(), live.log.frames.size());
  guint64 checked = 0;
  for (std::size_t i = 2; i < live.sent.size(); ++i) {
    if (live.sent[i - 1] == 0) continue;
    const double shown = 1000 * tracked_place(live.log.frames[i].camera).x;
    fail_unless(shown + 1.001 >= static_cast<double>(live.sent[i - 1]),
                "frame %zu shows the pose of %g ms; that of %g ms had come", i, shown,
                static_cast<double>(live.sent[i - 1]));
    ++checked;
  }
  fail_unless(checked > 10);
  gst_element_set_state(pipeline, GST_STATE_NULL);
}

ELEMENT_TEST(test_messages_that_are_none_are_counted) {
  GstElement* pipeline = parse(scenesrc("num-buffers=20") + " ! fakesink sync=false");
  CameraLog log;
  log_source(pipeline, log);
  {
    PosePusher poses(named(pipeline, "src"), false);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    poses.begin();
    fail_unless_equals_int(poses.push(0.0, 0), GST_FLOW_OK);
    for (const char* text : {"", "nonsense", "{}", "[[[[[[[["})
      fail_unless_equals_int(poses.push(text, 100 * GST_MSECOND), GST_FLOW_OK);
    fail_unless_equals_int(poses.push(std::string(100000, '{'), 0), GST_FLOW_OK);
    fail_unless_equals_int(poses.push(1.0, GST_CLOCK_TIME_NONE), GST_FLOW_OK);
    fail_unless_equals_int(poses.push(0.8, 800 * GST_MSECOND), GST_FLOW_OK);
    check_ended(wait_for_end(pipeline));
    fail_unless_equals_uint64(statistic(poses.element, "poses"), 2);
    fail_unless_equals_uint64(statistic(poses.element, "poses-unusable"), 6);
    for (const Shown& frame : log.frames)
      expect_place(frame.camera, {1e-9 * static_cast<double>(frame.time), -3, 0.3});
    gst_element_set_state(pipeline, GST_STATE_NULL);
  }
  // Without the pad, or with one that nothing is linked to, the viewport is the properties'.
  GstElement* source = named(pipeline, "src");
  GstPad* track = gst_element_request_pad_simple(source, "track");
  play(pipeline);
  fail_unless(std::abs(log.frames.back().camera.centre().x - 5.0) < 1e-9);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_element_release_request_pad(source, track);
  gst_object_unref(track);
  stop(pipeline);
}

ELEMENT_TEST(test_unlinked_while_a_frame_waits) {
  GstElement* pipeline = parse(scenesrc("num-buffers=5") + " ! fakesink sync=false");
  {
    PosePusher poses(named(pipeline, "src"), false);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    poses.begin();
    fail_unless_equals_int(poses.push(0.0, 0), GST_FLOW_OK);
    g_usleep(50000);
    fail_unless(gst_pad_unlink(poses.pad, poses.track));
    check_ended(wait_for_end(pipeline));
    gst_element_set_state(pipeline, GST_STATE_NULL);
  }
  stop(pipeline);
}

ELEMENT_TEST(test_states) {
  check_states("tracksrc location=" + moving("states.pcap", 10 * ms, 500) + " ! src.track" +
                   scenesrc("") + " ! fakesink",
               20);
  check_states("tracksrc port=0 ! src.track" + scenesrc("is-live=true") + " ! fakesink", 10);
}
