// SPDX-License-Identifier: LGPL-2.1-or-later
// trackstamp with track-match=timecode: each frame has the pose of its own timecode, whenever that came.
#include <gst/check/gstharness.h>
#include <gst/video/video.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <random>
#include <thread>

#include "camera_announced.h"
#include "element_test.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::int64_t ms = GST_MSECOND;
const Folder folder;

/// The timecode of frame \p number of 25 a second, from 10 o'clock on.
Timecode code(int number) {
  Timecode result;
  result.hours = 10 + number / 90000;
  result.minutes = number / 1500 % 60;
  result.seconds = number / 25 % 60;
  result.frames = number % 25;
  return result;
}

nlohmann::json sample_of(const Timecode& t, double x) {
  nlohmann::json sample = track_examples::sample({}, {x, -3, 0.3});
  sample["timing"] = {{"timecode",
                       {{"hours", t.hours},
                        {"minutes", t.minutes},
                        {"seconds", t.seconds},
                        {"frames", t.frames},
                        {"frameRate", {{"num", t.numerator}, {"denom", t.denominator}}}}}};
  return sample;
}

/// trackstamp fed by hand: frames with timecodes, and poses.
struct Bench {
  explicit Bench(bool live = true, bool live_poses = true)
      : element(gst_element_factory_make("trackstamp", nullptr)),
        harness(gst_harness_new_with_element(element, "sink", "src")),
        bus(gst_bus_new()),
        poses(element, live_poses) {
    gst_element_set_bus(element, bus);
    gst_util_set_object_arg(G_OBJECT(element), "track-match", "timecode");
    gst_harness_set_live(harness, live);
    log_cameras(element, log);
    gst_harness_set_src_caps_str(harness,
                                 "video/x-raw,format=GRAY8,width=64,height=48,framerate=1000/1");
    poses.begin();
  }
  ~Bench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
  }
  void close() { gst_harness_teardown(harness); }
  /// A frame of \p t (of a count that leaves numbers out, if \p drops); where its camera is, by x.
  double send(const std::optional<Timecode>& t, bool drops = false, GstClockTime time = 0) {
    GstBuffer* buffer = gst_harness_create_buffer(harness, 64 * 48);
    GST_BUFFER_PTS(buffer) = time;
    if (t)
      gst_buffer_add_video_time_code_meta_full(
          buffer, static_cast<guint>(t->numerator), static_cast<guint>(t->denominator), nullptr,
          drops ? GST_VIDEO_TIME_CODE_FLAGS_DROP_FRAME : GST_VIDEO_TIME_CODE_FLAGS_NONE,
          static_cast<guint>(t->hours), static_cast<guint>(t->minutes),
          static_cast<guint>(t->seconds), static_cast<guint>(t->frames), 0);
    fail_unless_equals_int(gst_harness_push(harness, buffer), GST_FLOW_OK);
    return log.announced.viewport.width > 0 ? tracked_place(log.announced.viewport).x : -1.0;
  }
  void pose(const Timecode& t, double x, GstClockTime came = 0) {
    PoseMessage message;
    message.pose.place = {x, -3, 0.3};
    message.pose.timecode = t;
    poses.push(pose_message_to_json(message), came);
  }
  guint64 count(const char* name) { return statistic(element, name); }

  GstElement* element;
  GstHarness* harness;
  GstBus* bus;
  PosePusher poses;
  CameraLog log;
};

void expect_near(double found, double truth) {
  fail_unless(std::abs(found - truth) < 1e-6, "%.9g is not %.9g", found, truth);
}

}  // namespace

// Packets of the recommended minimum, which tells no other time, that come in bursts and late.
ELEMENT_TEST(test_each_frame_has_its_pose) {
  const std::filesystem::path path = folder.file("uneven.pcap");
  constexpr int count = 100;
  {
    std::mt19937 random(4);
    std::uniform_int_distribution<std::int64_t> late(0, 700 * ms);
    PacketRecorder recorder(path.string(), 55555);
    std::int64_t came = 0;
    for (int i = 0; i < count; ++i) {
      Timecode t = code(i);
      t.hours = 0;  // timecodestamper's begin
      came = std::max(came, 40 * ms * i + late(random));
      recorder.write({came, 0x7F000001, 4000,
                      track_examples::json_bytes(sample_of(t, i % 2 ? 0.01 * i : -0.01 * i))});
    }
  }
  for (const int delay : {0, 3, -2}) {
    GstElement* pipeline = parse(
        "tracksrc location=" + path.string() +
        " ! t.track videotestsrc num-buffers=" + std::to_string(count) +
        " ! video/x-raw,width=64,height=48,framerate=25/1 ! timecodestamper ! trackstamp name=t "
        "track-match=timecode track-delay=" +
        std::to_string(delay * 40 * ms) + " ! fakesink sync=false");
    GstElement* element = named(pipeline, "t");
    CameraLog log;
    log_cameras(element, log);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    check_ended(wait_for_end(pipeline));
    fail_unless_equals_int(log.frames.size(), count);
    for (int i = 0; i < count; ++i) {
      const int own = std::clamp(i - delay, 0, count - 1);
      expect_place(log.frames[static_cast<std::size_t>(i)].camera,
                   {own % 2 ? 0.01 * own : -0.01 * own, -3, 0.3});
    }
    fail_unless_equals_uint64(statistic(element, "frames-tracked"), count);
    fail_unless_equals_uint64(statistic(element, "poses-untimed"), 0);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}

// tracksrc's smoothing makes poses late by half of it, which their timecodes do not know.
ELEMENT_TEST(test_smoothed_poses) {
  const std::filesystem::path path = folder.file("smooth.pcap");
  {
    PacketRecorder recorder(path.string(), 55555);
    for (int i = 0; i < 100; ++i) {
      Timecode t = code(i);
      t.hours = 0;
      recorder.write(
          {40 * ms * i, 0x7F000001, 4000, track_examples::json_bytes(sample_of(t, 0.01 * i))});
    }
  }
  GstElement* pipeline = parse(
      "tracksrc smoothing=240000000 location=" + path.string() +
      " ! t.track videotestsrc num-buffers=80 ! video/x-raw,width=64,height=48,framerate=25/1 "
      "! timecodestamper ! trackstamp name=t track-match=timecode ! fakesink sync=false");
  GstElement* element = named(pipeline, "t");
  CameraLog log;
  log_cameras(element, log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  for (std::size_t i = 10; i < 80; ++i)
    expect_place(log.frames[i].camera, {0.01 * static_cast<double>(i), -3, 0.3});
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// Poses that are quicker than the video are there before its first frame has told how it counts.
ELEMENT_TEST(test_poses_before_the_first_frame) {
  Bench bench;
  for (int i = 0; i < 5; ++i) bench.pose(code(i), 0.1 * i);
  expect_near(bench.send(code(2)), 0.2);
  bench.close();
}

// Over the minute where 29.97 leaves numbers out, and over midnight. Who does not tell whether it does
// counts as the video.
ELEMENT_TEST(test_dropped_numbers_and_midnight) {
  for (const bool drops : {true, false}) {
    for (const bool told : {true, false}) {
      for (const bool midnight : {true, false}) {
        Bench bench;
        const auto frame = [&](int minutes, int seconds, int frames) {
          Timecode t{.hours = midnight ? 23 : 10, .minutes = minutes, .seconds = seconds};
          if (midnight && minutes == 0) t.hours = 0;
          t.frames = frames;
          t.numerator = 30000, t.denominator = 1001;
          if (told) t.drops = drops;
          return t;
        };
        const int begin = midnight ? 59 : 2, first = drops && !midnight ? 2 : 0;
        const int next = midnight ? 0 : 3;
        const Timecode codes[] = {frame(begin, 59, 28), frame(begin, 59, 29), frame(next, 0, first),
                                  frame(next, 0, first + 1)};
        bench.send(codes[0], drops);  // from here on it is known how the video counts
        for (int i = 0; i < 4; ++i) bench.pose(codes[i], i + 1);
        g_object_set(bench.element, "track-delay", gint64{-1001 * GST_SECOND / 60000}, nullptr);
        for (int i = 0; i < 3; ++i) expect_near(bench.send(codes[i], drops), i + 1.5);
        g_object_set(bench.element, "track-delay", gint64{0}, nullptr);
        for (int i = 0; i < 4; ++i) expect_near(bench.send(codes[i], drops), i + 1);
        bench.close();
      }
    }
  }
}

// Several under one timecode: the first is the frame's; the others lie between it and the next.
ELEMENT_TEST(test_more_poses_than_frames) {
  const auto between = [](bool parts) {
    Bench bench;
    bench.send(code(0));
    for (int i = 0; i < 12; ++i) {
      Timecode t = code(i / 4);
      if (parts) t.part = i % 4, t.parts = i % 4 ? 4 : 1;
      // All at once, where the parts are told; else evenly, but for a delay.
      const std::int64_t came = parts ? 0 : 10 * ms * i + 300 * ms * (i / 4);
      bench.pose(t, 0.01 * i, static_cast<GstClockTime>(came));
    }
    expect_near(bench.send(code(1)), 0.04);
    for (const std::int64_t early : {10, 15, 30}) {
      g_object_set(bench.element, "track-delay", gint64{early * ms}, nullptr);
      expect_near(bench.send(code(2)), 0.08 - 1e-3 * static_cast<double>(early));
    }
    bench.close();
  };
  between(true);
  between(false);
  // All at once and nothing told: each frame's first.
  Bench bench;
  bench.send(code(0));
  for (int i = 0; i < 12; ++i) bench.pose(code(i / 4), i);
  for (int i = 0; i < 3; ++i) expect_near(bench.send(code(i)), 4 * i);
  bench.close();
}

// One wrong timecode changes nothing; a jump holds from the second pose on, and for frames of before
// the jump the poses of before do.
ELEMENT_TEST(test_timecode_jumps) {
  Bench bench;
  bench.send(code(0));
  for (int i = 0; i < 10; ++i) bench.pose(code(i), i);
  Timecode wrong;
  wrong.hours = 15;
  bench.pose(wrong, 99);
  bench.pose(code(10), 10);
  bench.pose(code(8), 98);  // nor one that comes late
  bench.pose(code(11), 11);
  for (int i = 5; i < 12; ++i) expect_near(bench.send(code(i)), i);
  for (int i = 0; i < 5; ++i) bench.pose(code(i + 9000), 100 + i);
  expect_near(bench.send(code(9)), 9);
  expect_near(bench.send(code(11)), 11);
  for (int i = 0; i < 5; ++i) expect_near(bench.send(code(i + 9000)), 100 + i);
  fail_unless_equals_uint64(bench.count("track-losses"), 0);
  bench.close();
}

// Of a file: held until a frame has come, a second ahead at most, also over a jump; a seek goes along.
ELEMENT_TEST(test_file_along_with_the_video) {
  Bench bench(false, false);
  const auto label = [](int i) { return code(i < 100 ? i : i + 5000); };
  std::atomic<int> pushed{0};
  std::thread file([&] {
    for (int i = 0; i < 200; ++i, ++pushed) bench.pose(label(i), i);
    gst_pad_push_event(bench.poses.pad, gst_event_new_eos());
  });
  g_usleep(50000);
  fail_unless_equals_int(pushed, 0);
  for (int i = 0; i < 200; ++i) {
    expect_near(bench.send(label(i)), i);
    if (i % 20 == 19) g_usleep(20000);
    fail_unless(pushed <= i + (i > 70 && i < 100 ? 56 : 29), "%d poses have come at frame %d",
                pushed.load(), i);
  }
  file.join();
  bench.close();
}

// Whatever tells no timecode, or that of another clock: counted and said.
ELEMENT_TEST(test_what_does_not_tell) {
  Bench bench;
  bench.send(code(0));
  bench.poses.push(0.5, 0);
  fail_unless_equals_uint64(bench.count("poses-untimed"), 1);
  fail_unless(warnings_on(bench.bus).at(0).find("track-match=running-time") != std::string::npos);
  bench.pose(code(1), 1);
  expect_near(bench.send(code(1)), 1);
  expect_near(bench.send({}), 1);
  fail_unless_equals_uint64(bench.count("frames-untimed"), 1);
  fail_unless(warnings_on(bench.bus).at(0).find("timecodestamper") != std::string::npos);
  Timecode apart = code(1);
  for (const bool later : {true, false}) {
    apart.hours = later ? 11 : 9;
    bench.send(apart);
    const std::string said = warnings_on(bench.bus).at(0);
    fail_unless(said.find(later ? "3600.0 s earlier" : "3600.0 s later") != std::string::npos, "%s",
                said.c_str());
    bench.send(code(1));
    g_usleep(1100000);  // one warning a second
    bench.pose(code(1), 1);
  }
  fail_unless_equals_uint64(bench.count("track-losses"), 2);
  bench.close();
}

// Live: poses may be matched otherwise from now on; a delay that asks for later ones makes frames wait.
ELEMENT_TEST(test_settings_are_live) {
  Bench bench;
  bench.send(code(0));
  bench.pose(code(1), 1, 500 * ms);
  expect_near(bench.send(code(1)), 1);
  gst_util_set_object_arg(G_OBJECT(bench.element), "track-match", "running-time");
  bench.pose(code(7), 7, 600 * ms);
  expect_near(bench.send(code(1), false, 600 * ms), 7);
  g_object_set(bench.element, "track-delay", gint64{-30 * ms}, nullptr);
  fail_unless(latencies_told(bench.bus) > 0);
  fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), 31 * GST_MSECOND);
  bench.pose(code(8), 8, 650 * ms);
  expect_near(bench.send(code(1), false, 595 * ms), 7.5);
  bench.close();
}
