// SPDX-License-Identifier: LGPL-2.1-or-later
// trackstamp's pad scene: what another program says of its camera, lights and scene is announced with
// the frame that it says it of.
#include <gst/check/gstharness.h>
#include <gst/net/gstnetaddressmeta.h>
#include <gst/video/video.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "camera_announced.h"
#include "element_test.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

using nlohmann::json;

constexpr std::int64_t ms = GST_MSECOND;
const Folder folder;

/// The message of a camera \p number metres from the scene's origin and a lamp as bright.
json message(int number) {
  Announcement announcement;
  announcement.viewport = look_at({0, 1, 1.0 * number}, {0, 1, 0}, 40, 64, 48);
  announcement.scene = "builtin:room";
  Light lamp;
  lamp.radiance = Vec3f(static_cast<float>(number));
  announcement.lights = {lamp};
  return json::parse(announcement_to_json(announcement));
}

std::string line(json with) {
  return with.dump() + "\n";
}

json at_timecode(int number, const std::string& timecode, int rate = 25, int of = 1) {
  json out = message(number);
  out["timecode"] = timecode;
  out["timecode_rate"] = {rate, of};
  return out;
}

json at_stream_time(int number, std::int64_t time) {
  json out = message(number);
  out["stream_time_ns"] = time;
  return out;
}

/// The number of the message() that was announced, by camera and lamp; 0: none, -1: they differ.
int number_of(const Announcement& announced) {
  if (announced.viewport.width == 0) return 0;
  const int number = static_cast<int>(std::lround(announced.viewport.centre().z));
  const bool same =
      announced.lights.size() == 1 && static_cast<int>(announced.lights[0].radiance.x) == number;
  return same ? number : -1;
}

/// \p buffer as taken at \p time, ns, of \p clock: "unix" or "ptp".
GstBuffer* taken_at(GstBuffer* buffer, std::int64_t time, const std::string& clock = "unix") {
  GstCaps* caps = gst_caps_new_empty_simple(("timestamp/x-" + clock).c_str());
  gst_buffer_add_reference_timestamp_meta(buffer, caps, static_cast<guint64>(time),
                                          GST_CLOCK_TIME_NONE);
  gst_caps_unref(caps);
  return buffer;
}

/// trackstamp fed by hand: frames of a source that is live or not, and what comes at its pad scene.
struct Bench {
  explicit Bench(const char* match, bool live = true, bool live_video = true)
      : element(gst_element_factory_make("trackstamp", nullptr)),
        harness(gst_harness_new_with_element(element, "sink", "src")),
        bus(gst_bus_new()),
        messages(element, live, 0, "scene") {
    gst_element_set_bus(element, bus);
    gst_util_set_object_arg(G_OBJECT(element), "scene-match", match);
    g_object_set(element, "scene-wait", guint64{0}, nullptr);
    if (live_video) gst_harness_set_upstream_latency(harness, 30 * GST_MSECOND);
    gst_harness_set_live(harness, live_video);
    log_cameras(element, log);
    gst_harness_set_src_caps_str(harness,
                                 "video/x-raw,format=GRAY8,width=64,height=48,framerate=25/1");
    messages.begin();
  }
  ~Bench() {
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
  }
  void close() { gst_harness_teardown(harness); }

  GstBuffer* frame(int number) {
    GstBuffer* buffer = gst_harness_create_buffer(harness, 64 * 48);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(40 * ms * number);
    return buffer;
  }
  /// Sends it; the number_of() what is announced for it, -1 also where it is refused: other threads may call
  /// this, and checks are the case's own thread's (element_test.h).
  int send(GstBuffer* buffer) {
    return gst_harness_push(harness, buffer) == GST_FLOW_OK ? number_of(log.announced) : -1;
  }
  int send_at(int number, const char* timecode, int rate = 25, int of = 1) {
    GstBuffer* buffer = frame(number);
    GstVideoTimeCode* code = gst_video_time_code_new_from_string(timecode);
    code->config.fps_n = static_cast<guint>(rate);
    code->config.fps_d = static_cast<guint>(of);
    gst_buffer_add_video_time_code_meta(buffer, code);
    gst_video_time_code_free(code);
    return send(buffer);
  }
  void say(const json& what, GstClockTime time = GST_CLOCK_TIME_NONE) {
    messages.push(line(what), time);
  }
  guint64 count(const char* name) { return statistic(element, name); }

  GstElement* element;
  GstHarness* harness;
  GstBus* bus;
  PosePusher messages;
  CameraLog log;
};

}  // namespace

ELEMENT_TEST(test_each_frame_has_its_message_by_timecode) {
  Bench bench("timecode");
  fail_unless_equals_int(bench.send_at(0, "10:00:00:23"), 0);  // nothing has come yet
  // In no order that matters.
  bench.say(at_timecode(3, "10:00:01:01"));
  bench.say(at_timecode(1, "10:00:00:24"));
  bench.say(at_timecode(2, "10:00:01:00"));
  fail_unless_equals_int(bench.send_at(1, "10:00:00:24"), 1);
  fail_unless_equals_int(bench.send_at(2, "10:00:01:00"), 2);
  fail_unless_equals_int(bench.send_at(3, "10:00:01:01"), 3);
  fail_unless_equals_int(bench.send_at(4, "10:00:01:02"), 3);  // it holds until another comes
  fail_unless_equals_int(bench.send_at(5, "10:00:00:24"), 1);  // the video jumps back
  fail_unless_equals_uint64(bench.count("scene-messages"), 3);
  fail_unless_equals_uint64(bench.count("frames-announced"), 5);
  fail_unless_equals_uint64(bench.count("frames-unannounced"), 1);
  fail_unless_equals_uint64(bench.count("scene-messages-late"), 0);
  bench.close();
}

// The hour 0 follows the hour 23; and timecodes of 29.97 frames/s with and without dropping.
ELEMENT_TEST(test_midnight) {
  for (const bool drops : {true, false}) {
    const char sign = drops ? ';' : ':';
    const auto code = [&](const char* begin, const char* end) {
      return std::string(begin) + sign + end;
    };
    Bench bench("timecode");
    bench.say(at_timecode(1, code("23:59:59", "28"), 30000, 1001));
    bench.say(at_timecode(2, code("23:59:59", "29"), 30000, 1001));
    bench.say(at_timecode(3, code("00:00:00", "00"), 30000, 1001));
    bench.say(at_timecode(4, code("00:00:00", "01"), 30000, 1001));
    const char* codes[] = {"23:59:59", "23:59:59", "00:00:00", "00:00:00"};
    const char* frames[] = {"28", "29", "00", "01"};
    for (int i = 0; i < 4; ++i)
      fail_unless_equals_int(bench.send_at(i, code(codes[i], frames[i]).c_str(), 30000, 1001),
                             i + 1);
    bench.close();
  }
}

ELEMENT_TEST(test_delay_is_live) {
  Bench bench("timecode");
  for (int i = 0; i < 9; ++i) bench.say(at_timecode(i + 1, "01:00:00:0" + std::to_string(i)));
  fail_unless_equals_int(bench.send_at(4, "01:00:00:04"), 5);
  g_object_set(bench.element, "scene-delay", gint64{80 * ms}, nullptr);
  fail_unless_equals_int(bench.send_at(5, "01:00:00:05"), 4);
  g_object_set(bench.element, "scene-delay", gint64{-40 * ms}, nullptr);
  fail_unless_equals_int(bench.send_at(6, "01:00:00:06"), 8);
  bench.close();
}

ELEMENT_TEST(test_by_clock) {
  Bench bench("clock");
  constexpr std::int64_t begin = 1'700'000'000'000'000'000;
  const auto send = [&](int number, std::int64_t time) {
    return bench.send(taken_at(bench.frame(number), time));
  };
  for (int i = 0; i < 3; ++i) {
    json said = message(i + 1);
    said["unix_time_ns"] = begin + 40 * ms * i;
    bench.say(said);
  }
  // Within half a frame.
  fail_unless_equals_int(send(0, begin), 1);
  fail_unless_equals_int(send(1, begin + 40 * ms - 19 * ms), 2);
  fail_unless_equals_int(send(2, begin + 80 * ms + 19 * ms), 3);
  // A frame that does not tell keeps what was.
  fail_unless_equals_int(bench.send(bench.frame(3)), 3);
  fail_unless_equals_uint64(bench.count("frames-unmatchable"), 1);
  // Of a frame with several clocks' times the one that messages tell counts.
  fail_unless_equals_int(bench.send(taken_at(taken_at(bench.frame(4), 7, "ptp"), begin)), 1);
  fail_unless_equals_uint64(bench.count("frames-unmatchable"), 1);
  bench.close();
}

// As an RTP stream without a rate has it: a frame is as long as the one before.
ELEMENT_TEST(test_frames_of_unknown_rate) {
  Bench bench("clock");
  gst_harness_set_src_caps_str(bench.harness,
                               "video/x-raw,format=GRAY8,width=64,height=48,framerate=0/1");
  constexpr std::int64_t begin = 1'700'000'000'000'000'000;
  for (int i = 0; i < 4; ++i) {
    json said = message(i + 1);
    said["unix_time_ns"] = begin + 40 * ms * i + 5000;  // otherwise rounded
    bench.say(said);
  }
  for (int i = 0; i < 4; ++i) {
    const int found = bench.send(taken_at(bench.frame(i), begin + 40 * ms * i));
    fail_unless_equals_int(found, i == 0 ? 0 : i + 1);
  }
  // From 16 to 40 ms a frame, as cameras do in the dark: 19 ms are half a frame only then.
  std::int64_t time = 160 * ms;
  for (int i = 0; i < 12; ++i, time += i < 6 ? 16 * ms : 40 * ms) {
    json said = message(5 + i);
    said["unix_time_ns"] = begin + time + 19 * ms;
    bench.say(said);
    GstBuffer* buffer = bench.frame(0);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(time);
    const int found = bench.send(taken_at(buffer, begin + time));
    if (i >= 8) fail_unless_equals_int(found, 5 + i);
    if (i >= 2 && i < 6) fail_unless(found >= 0 && found < 5 + i);
  }
  bench.close();
}

ELEMENT_TEST(test_by_arrival) {
  Bench bench("arrival");
  bench.say(message(1), 10 * ms);
  fail_unless_equals_int(bench.send(bench.frame(1)), 1);
  bench.say(message(2), 79 * ms);
  bench.say(message(3), 81 * ms);
  fail_unless_equals_int(bench.send(bench.frame(2)), 2);
  fail_unless_equals_int(bench.send(bench.frame(3)), 3);
  g_object_set(bench.element, "scene-delay", gint64{80 * ms}, nullptr);
  fail_unless_equals_int(bench.send(bench.frame(4)), 2);
  bench.close();
}

// tcpclientsrc gives no times: beside live video the messages hold from when they come.
ELEMENT_TEST(test_by_arrival_without_times) {
  Bench bench("arrival", false);
  gst_harness_use_testclock(bench.harness);
  gst_harness_set_time(bench.harness, 50 * ms);
  bench.say(message(1));  // before the video has begun
  fail_unless_equals_int(bench.send(bench.frame(0)), 0);
  fail_unless_equals_int(bench.send(bench.frame(1)), 0);
  fail_unless_equals_int(bench.send(bench.frame(2)), 1);
  g_object_set(bench.element, "scene-delay", gint64{10 * GST_SECOND}, nullptr);
  for (int i = 2; i < 100; ++i) {
    gst_harness_set_time(bench.harness, static_cast<GstClockTime>(40 * ms * i));
    bench.say(message(i));
    fail_unless(bench.send(bench.frame(i)) >= 0);
  }
  fail_unless_equals_int(bench.send(bench.frame(252)), 2);
  fail_unless_equals_uint64(bench.count("scene-messages-untimed"), 0);
  bench.close();
  Bench files("arrival", false, false);
  files.say(message(1));
  fail_unless(files.send(files.frame(0)) >= 0);
  fail_unless_equals_uint64(files.count("scene-messages-untimed"), 1);
  fail_unless(warnings_on(files.bus).at(0).find("scene-match=timecode") != std::string::npos);
  files.close();
}

// What it may wait for, and no more.
ELEMENT_TEST(test_latency) {
  for (const char* match : {"timecode", "arrival"}) {
    for (const bool with_depth : {false, true}) {
      Bench bench(match);
      g_object_set(bench.element, "scene-wait", guint64{15 * GST_MSECOND}, nullptr);
      latencies_told(bench.bus);
      std::optional<PosePusher> depth;
      if (with_depth) depth.emplace(bench.element, true, 0, "depth");
      const bool waits = with_depth || std::string(match) == "timecode";
      fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), (waits ? 45 : 30) * ms);
      g_object_set(bench.element, "scene-wait", guint64{20 * GST_MSECOND}, nullptr);
      fail_unless_equals_int(latencies_told(bench.bus), waits ? 1 : 0);
      depth.reset();
      bench.close();
    }
  }
}

// Lines in a file, cut anywhere; they do not run away from the frames, and a seek takes them along.
ELEMENT_TEST(test_file_along_with_the_video) {
  const std::filesystem::path path = folder.file("messages.jsonl");
  {
    std::ofstream out(path);
    for (int i = 0; i < 100; ++i) {
      std::string text = line(at_stream_time(i + 1, i * 1'000'000'000LL / 30));
      if (i == 99) text.pop_back();  // the last line need not end
      out << text;
    }
  }
  GstElement* pipeline = parse(
      "filesrc blocksize=777 location=" + path.string() +
      " ! t.scene videotestsrc num-buffers=100 ! video/x-raw,width=64,height=48,framerate=30/1 ! "
      "trackstamp name=t scene-match=stream-time ! fakesink sync=false");
  GstElement* element = named(pipeline, "t");
  CameraLog log;
  log_cameras(element, log);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  fail_unless_equals_int(log.frames.size(), 100);
  for (std::size_t i = 0; i < 100; ++i)
    fail_unless_equals_int(std::lround(log.frames[i].camera.centre().z), static_cast<int>(i + 1));
  fail_unless_equals_uint64(statistic(element, "frames-announced"), 100);
  gst_element_set_state(pipeline, GST_STATE_READY);
  gst_element_set_state(pipeline, GST_STATE_PAUSED);
  gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND);
  fail_unless(gst_element_seek_simple(pipeline, GST_FORMAT_TIME,
                                      static_cast<GstSeekFlags>(GST_SEEK_FLAG_FLUSH), GST_SECOND));
  gst_element_get_state(pipeline, nullptr, nullptr, 20 * GST_SECOND);
  fail_unless_equals_int(std::lround(log.frames.back().camera.centre().z), 31);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// More lines than are kept, at once.
ELEMENT_TEST(test_many_lines_in_one_buffer) {
  Bench bench("stream-time", false, false);
  constexpr int count = 2500;
  std::string lines;
  for (int i = 0; i < count; ++i) lines += line(at_stream_time(i + 1, 40 * ms * i));
  GstFlowReturn flow = GST_FLOW_ERROR;
  std::thread file([&] { flow = bench.messages.push(lines, GST_CLOCK_TIME_NONE); });
  for (int i = 0; i < count; ++i) fail_unless_equals_int(bench.send(bench.frame(i)), i + 1);
  file.join();
  fail_unless_equals_int(flow, GST_FLOW_OK);
  fail_unless_equals_uint64(bench.count("frames-announced"), count);
  bench.close();
}

// A frame of live video waits for its message; a frame that has waited long enough goes on.
ELEMENT_TEST(test_live_frame_waits) {
  Bench bench("timecode");
  g_object_set(bench.element, "scene-wait", guint64{10 * GST_SECOND}, nullptr);
  fail_unless_equals_uint64(gst_harness_query_latency(bench.harness), 10'030 * GST_MSECOND);
  int announced = 0;
  std::thread frame([&] { announced = bench.send_at(0, "10:00:00:00"); });
  g_usleep(50000);
  bench.say(at_timecode(4, "10:00:00:00"));
  frame.join();
  fail_unless_equals_int(announced, 4);
  g_object_set(bench.element, "scene-wait", guint64{0}, nullptr);
  fail_unless_equals_int(bench.send_at(1, "10:00:00:01"), 4);
  bench.say(at_timecode(5, "10:00:00:01"));  // too late
  fail_unless_equals_uint64(bench.count("scene-messages-late"), 1);
  bench.close();
}

// One message of a far later time: frames wait for theirs as before.
ELEMENT_TEST(test_message_of_another_time) {
  Bench bench("timecode");
  bench.say(at_timecode(1, "10:00:00:00"));
  bench.say(at_timecode(9, "15:00:00:00"));
  fail_unless_equals_int(bench.send_at(0, "10:00:00:00"), 1);
  g_object_set(bench.element, "scene-wait", guint64{10 * GST_SECOND}, nullptr);
  int announced = 0;
  std::thread frame([&] { announced = bench.send_at(1, "10:00:00:01"); });
  g_usleep(50000);
  bench.say(at_timecode(2, "10:00:00:01"));
  frame.join();
  fail_unless_equals_int(announced, 2);
  bench.close();
}

// The sender's timecode and the video's begin again: what holds is of the same turn.
ELEMENT_TEST(test_live_timecode_begins_again) {
  Bench bench("timecode");
  const auto code = [](int i) { return "10:00:0" + std::to_string(i) + ":00"; };
  for (int i = 0; i < 5; ++i) {
    bench.say(at_timecode(i + 1, code(i)));
    fail_unless_equals_int(bench.send_at(25 * i, code(i).c_str()), i + 1);
  }
  g_object_set(bench.element, "scene-wait", guint64{10 * GST_SECOND}, nullptr);
  for (int i = 0; i < 5; ++i) {
    int announced = 0;
    std::thread frame([&] { announced = bench.send_at(125 + 25 * i, code(i).c_str()); });
    g_usleep(20000);
    bench.say(at_timecode(10 + i, code(i)));
    frame.join();
    fail_unless_equals_int(announced, 10 + i);
  }
  bench.close();
}

// Lines and video jump to an earlier hour, or to a later one, and back to the one where they were.
ELEMENT_TEST(test_file_whose_timecode_jumps) {
  const auto code = [](int i) {
    const int hours[] = {10, 1, 10, 15};
    char text[64];
    std::snprintf(text, sizeof text, "%02d:00:%02d:%02d", hours[i / 700], i % 700 / 25, i % 25);
    return std::string(text);
  };
  constexpr int count = 4 * 700;
  Bench bench("timecode", false, false);
  std::thread file([&] {
    std::string lines;
    for (int i = 0; i < count; ++i) {
      lines += line(at_timecode(i + 1, code(i)));
      if (i % 7 != 6) continue;
      bench.messages.push(lines, GST_CLOCK_TIME_NONE);
      lines.clear();
    }
  });
  for (int i = 0; i < count; ++i) {
    fail_unless_equals_int(bench.send_at(i, code(i).c_str()), i + 1);
    if (i % 700 != 699) continue;
    // Lets the file run ahead as far as it may.
    for (guint64 before = 0, now = 1; before != now; now = bench.count("scene-messages")) {
      before = now;
      g_usleep(50000);
    }
  }
  file.join();
  fail_unless_equals_uint64(bench.count("scene-messages"), count);
  fail_unless_equals_uint64(bench.count("frames-announced"), count);
  bench.close();
}

ELEMENT_TEST(test_flush_ends_the_waiting) {
  Bench bench("timecode", false, false);
  GstFlowReturn flow = GST_FLOW_ERROR;
  std::thread frame([&] {
    GstBuffer* buffer = bench.frame(0);
    gst_buffer_add_video_time_code_meta_full(buffer, 25, 1, nullptr, GST_VIDEO_TIME_CODE_FLAGS_NONE,
                                             10, 0, 0, 0, 0);
    flow = gst_harness_push(bench.harness, buffer);
  });
  g_usleep(50000);
  gst_harness_push_event(bench.harness, gst_event_new_flush_start());
  frame.join();
  fail_unless_equals_int(flow, GST_FLOW_FLUSHING);
  gst_harness_push_event(bench.harness, gst_event_new_flush_stop(TRUE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(bench.harness, gst_event_new_segment(&segment));
  bench.say(at_timecode(4, "10:00:00:00"));
  fail_unless_equals_int(bench.send_at(0, "10:00:00:00"), 4);
  bench.close();
}

// A seek goes to the messages first: a frame of before comes among those from the begin again.
ELEMENT_TEST(test_frame_of_before_a_seek) {
  Bench bench("stream-time", false, false);
  for (int i = 0; i < 20; ++i) bench.say(at_stream_time(i + 1, 40 * ms * i));
  gst_pad_push_event(bench.messages.pad, gst_event_new_eos());
  fail_unless(bench.send(bench.frame(2000)) >= 0);
  gst_harness_push_event(bench.harness, gst_event_new_flush_start());
  gst_harness_push_event(bench.harness, gst_event_new_flush_stop(TRUE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(bench.harness, gst_event_new_segment(&segment));
  for (int i = 3; i < 20; ++i) fail_unless_equals_int(bench.send(bench.frame(i)), i + 1);
  bench.close();
}

ELEMENT_TEST(test_silence_is_said_once) {
  // As udpsrc gives them, and as tcpclientsrc does, which does not say that it is live.
  for (const bool live : {true, false}) {
    Bench bench("timecode", live);
    bench.say(at_timecode(1, "10:00:00:00"));
    fail_unless_equals_int(bench.send_at(0, "10:00:01:00"), 1);
    fail_unless_equals_uint64(bench.count("scene-losses"), 0);
    for (int i = 1; i < 4; ++i)
      fail_unless_equals_int(bench.send_at(i, ("10:00:02:0" + std::to_string(i)).c_str()), 1);
    fail_unless_equals_uint64(bench.count("scene-losses"), 1);
    fail_unless_equals_uint64(bench.count("frames-unannounced"), 3);
    fail_unless_equals_int(warnings_on(bench.bus).size(), 1);
    bench.say(at_timecode(2, "10:00:02:10"));
    fail_unless_equals_int(bench.send_at(5, "10:00:02:10"), 2);
    fail_unless_equals_uint64(bench.count("frames-announced"), 2);
    bench.close();
  }
}

// Of a sender that does not say that it is live, messages ahead by mistake wait, and nothing holds.
ELEMENT_TEST(test_messages_of_a_later_time) {
  Bench bench("timecode", false);
  bench.say(at_timecode(1, "11:00:00:00"));
  fail_unless_equals_int(bench.send_at(0, "10:00:00:00"), 0);
  fail_unless_equals_int(bench.send_at(25, "10:00:01:00"), 0);
  fail_unless_equals_uint64(bench.count("scene-losses"), 0);
  fail_unless_equals_int(bench.send_at(26, "10:00:01:01"), 0);
  fail_unless_equals_uint64(bench.count("scene-losses"), 1);
  const std::string warning = warnings_on(bench.bus).at(0);
  fail_unless(warning.find("holds 3599.0 s later") != std::string::npos, "%s", warning.c_str());
  bench.close();
}

// A datagram is a message, whatever came before it.
ELEMENT_TEST(test_datagrams_are_messages) {
  Bench bench("timecode");
  GSocketAddress* sender = g_inet_socket_address_new_from_string("127.0.0.1", 40000);
  const auto datagram = [&](const std::string& bytes) {
    GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
    gst_buffer_add_net_address_meta(buffer, sender);
    fail_unless_equals_int(gst_pad_push(bench.messages.pad, buffer), GST_FLOW_OK);
  };
  datagram("stray");
  fail_unless_equals_uint64(bench.count("scene-messages-unusable"), 1);
  datagram(line(at_timecode(1, "10:00:00:00")));
  datagram(at_timecode(2, "10:00:00:01").dump());  // without the line feed
  datagram(line(at_timecode(3, "10:00:00:02")) + at_timecode(4, "10:00:00:03").dump());
  for (int i = 0; i < 4; ++i)
    fail_unless_equals_int(bench.send_at(i, ("10:00:00:0" + std::to_string(i)).c_str()), i + 1);
  // Nor does it end what came otherwise.
  bench.messages.push("{", GST_CLOCK_TIME_NONE);
  datagram(line(at_timecode(5, "10:00:00:04")));
  fail_unless_equals_int(bench.send_at(4, "10:00:00:04"), 5);
  fail_unless_equals_uint64(bench.count("scene-messages-unusable"), 2);
  fail_unless_equals_uint64(bench.count("scene-messages"), 5);
  g_object_unref(sender);
  bench.close();
}

// A sender that forgets the line feeds is there; it is told what is missing.
ELEMENT_TEST(test_messages_without_line_feeds) {
  Bench bench("timecode");
  const std::string said = at_timecode(1, "10:00:00:00").dump();
  fail_unless_equals_int(bench.send_at(0, "10:00:00:00"), 0);
  for (int i = 0; i < 3; ++i) bench.messages.push(said, GST_CLOCK_TIME_NONE);
  fail_unless_equals_int(bench.send_at(1, "10:00:01:01"), 0);
  const std::string warning = warnings_on(bench.bus).at(0);
  fail_unless(warning.find(std::to_string(3 * said.size()) + " bytes") != std::string::npos &&
                  warning.find("line feed") != std::string::npos,
              "%s", warning.c_str());
  bench.close();
}

// Whatever comes: said, counted, and what held goes on.
ELEMENT_TEST(test_what_is_no_message) {
  Bench bench("timecode");
  bench.say(at_timecode(7, "10:00:00:00"));
  json wrong_version = at_timecode(1, "10:00:00:01");
  wrong_version["version"] = 2;
  json no_rate = at_timecode(1, "10:00:00:01");
  no_rate.erase("timecode_rate");
  json no_rotation = at_timecode(1, "10:00:00:01");
  no_rotation["viewport"]["R"][0] = 2;
  json huge = at_timecode(1, "10:00:00:01");
  huge["viewport"]["width"] = 1e300;
  const std::string unusable[] = {"{",
                                  "[]",
                                  "7",
                                  "\xff\xfe",
                                  std::string(3 << 20, '['),
                                  wrong_version.dump(),
                                  no_rate.dump(),
                                  no_rotation.dump(),
                                  huge.dump()};
  guint64 count = 0;
  for (const std::string& text : unusable) {
    bench.messages.push(text + "\n", GST_CLOCK_TIME_NONE);
    fail_unless_equals_uint64(bench.count("scene-messages-unusable"), ++count);
  }
  const json untimed[] = {message(1), at_stream_time(1, 0), at_timecode(1, "10:00:00:25"),
                          at_timecode(1, "yesterday"), at_timecode(1, "00:01:00;00", 30000, 1001)};
  count = 0;
  for (const json& what : untimed) {
    bench.say(what);
    fail_unless_equals_uint64(bench.count("scene-messages-untimed"), ++count);
  }
  const auto said = warnings_on(bench.bus);
  fail_unless_equals_int(said.size(), 2);  // one a second of each kind
  fail_unless(said[1].find("'timecode'") != std::string::npos, "%s", said[1].c_str());
  bench.messages.push("", GST_CLOCK_TIME_NONE);
  bench.messages.push("\n \r\n", GST_CLOCK_TIME_NONE);
  fail_unless_equals_int(bench.send_at(1, "10:00:00:01"), 7);
  fail_unless_equals_uint64(bench.count("scene-messages"), 1);
  bench.close();
}

// The track's camera stands before the messages'; scene-file before the scene that they name.
ELEMENT_TEST(test_track_and_file_go_before) {
  Bench bench("timecode");
  PosePusher poses(bench.element, true);
  poses.begin();
  poses.push(0.5, 0);
  g_object_set(bench.element, "scene-file", "builtin:another", nullptr);
  bench.say(at_timecode(3, "10:00:00:00"));
  GstBuffer* buffer = bench.frame(0);
  gst_buffer_add_video_time_code_meta_full(buffer, 25, 1, nullptr, GST_VIDEO_TIME_CODE_FLAGS_NONE,
                                           10, 0, 0, 0, 0);
  fail_unless_equals_int(gst_harness_push(bench.harness, buffer), GST_FLOW_OK);
  expect_place(bench.log.announced.viewport, {0.5, -3, 0.3});
  fail_unless(bench.log.announced.lights[0].radiance.x == 3.0f);
  fail_unless(bench.log.announced.scene == "builtin:another");
  bench.close();
}

ELEMENT_TEST(test_states) {
  const std::filesystem::path path = folder.file("states.jsonl");
  std::ofstream out(path);
  for (int i = 0; i < 3000; ++i) out << line(at_stream_time(i + 1, 40 * ms * i));
  out.close();
  check_states("filesrc location=" + path.string() +
                   " ! t.scene videotestsrc ! trackstamp name=t scene-match=stream-time ! fakesink",
               20);
  check_states(
      "udpsrc port=0 ! t.scene videotestsrc is-live=true ! timecodestamper ! trackstamp name=t ! "
      "fakesink",
      6);
}
