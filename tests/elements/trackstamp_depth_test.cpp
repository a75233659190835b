// SPDX-License-Identifier: LGPL-2.1-or-later
// trackstamp's pad depth: a second video's frames go along with the first's, and composite hides subjects
// behind what they show.
#include <gst/check/gstharness.h>
#include <gst/video/video.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
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

/// Lines of \p count frames at 25 frames/s of a camera before the origin; \p near: depth_near, 0: none.
std::string write_messages(const char* name, int count, double near) {
  Announcement announcement;
  announcement.viewport = look_at({0, 1.2, 3.5}, {0, 1, 0}, 45, 96, 64);
  announcement.depth_near = near;
  json said = json::parse(announcement_to_json(announcement));
  fail_unless(said.contains("depth_near") == (near > 0));
  const std::filesystem::path path = folder.file(name);
  std::ofstream out(path);
  for (int i = 0; i < count; ++i) {
    said["stream_time_ns"] = 40 * ms * i;
    out << said.dump() << "\n";
  }
  return path.string();
}

struct Result {
  guint64 changed, without;
};

/// What composite has drawn of a hull before a grey picture of 3 frames whose depth \p depth is.
Result composited(const std::string& messages, const std::string& depth,
                  const char* settings = "backend=processor", const char* video = "RGBA") {
  std::string line = "filesrc location=" + messages +
                     " ! t.scene videotestsrc pattern=blue num-buffers=3 ! "
                     "video/x-raw,format=" +
                     video +
                     ",width=96,height=64,framerate=25/1 ! "
                     "trackstamp name=t scene-match=stream-time ! c.background " +
                     depth + " composite name=c shadow=off " + settings +
                     " ! fakesink hullbuild name=h ! c.mesh_0";
  for (const char* camera : {"cam0", "cam1", "cam2"})
    line += std::string(" rigtestsrc num-buffers=1 camera=") + camera +
            " ! silhouette camera=" + camera + " ! h.";
  GstElement* pipeline = parse(line);
  GstElement* stamp = named(pipeline, "t");
  GstElement* composite = named(pipeline, "c");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  const Result result{statistic(composite, "pixels-changed"),
                      statistic(stamp, "frames-without-depth")};
  fail_unless_equals_uint64(statistic(composite, "frames"), 3);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
  return result;
}

std::string depth_of(const char* pattern, const char* format = "GRAY16_LE", int count = 3) {
  return std::string("videotestsrc pattern=") + pattern + " num-buffers=" + std::to_string(count) +
         " ! video/x-raw,format=" + format + ",width=48,height=32,framerate=25/1 ! t.depth";
}

/// trackstamp fed by hand at sink and depth, of 2x1 pixels, matched by running time.
struct Bench {
  explicit Bench(bool live, const char* match = "stream-time", bool live_video = false)
      : element(gst_element_factory_make("trackstamp", nullptr)),
        frames(gst_harness_new_with_element(element, "sink", "src")),
        messages(element, live, 0, "scene"),
        depths(element, live, 0, "depth") {
    gst_util_set_object_arg(G_OBJECT(element), "scene-match", match);
    g_object_set(element, "scene-wait", guint64{0}, nullptr);
    gst_harness_set_live(frames, live || live_video);
    gst_harness_set_src_caps_str(frames,
                                 "video/x-raw,format=GRAY8,width=4,height=1,framerate=25/1");
    messages.begin();
    Announcement announcement;
    announcement.viewport = look_at({0, 1, 3}, {0, 1, 0}, 45, 4, 1);
    announcement.depth_near = 0.5;
    json said = json::parse(announcement_to_json(announcement));
    said["timecode"] = "23:59:59:00";
    said["timecode_rate"] = {25, 1};
    said["stream_time_ns"] = 0;
    messages.push(said.dump() + "\n", GST_CLOCK_TIME_NONE);
    said["stream_time_ns"] = 900 * ms;
    messages.push(said.dump() + "\n", GST_CLOCK_TIME_NONE);
    depths.begin("video/x-raw,format=GRAY16_BE,width=2,height=1,framerate=25/1");
  }
  void close() {
    fail_unless(sound, "a frame was refused or changed");
    gst_harness_teardown(frames);
  }
  static void mark(GstBuffer* buffer, const std::string& timecode) {
    if (timecode.empty()) return;
    GstVideoTimeCode* code = gst_video_time_code_new_from_string(timecode.c_str());
    code->config.fps_n = 25;
    code->config.fps_d = 1;
    gst_buffer_add_video_time_code_meta(buffer, code);
    gst_video_time_code_free(code);
  }
  /// Whether a frame of \p time goes out with a depth. Notes for close() what else is wrong with it: other
  /// threads may call this, and checks are the case's own thread's (element_test.h).
  bool send(std::int64_t time, const std::string& timecode = "") {
    GstBuffer* buffer = gst_harness_create_buffer(frames, 4);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(time);
    mark(buffer, timecode);
    GstBuffer* held = gst_buffer_ref(buffer);  // so that it cannot be written to
    if (gst_harness_push(frames, buffer) != GST_FLOW_OK) {
      gst_buffer_unref(held);
      return sound = false;
    }
    GstBuffer* out = gst_harness_pull(frames);
    const GType api = g_type_from_name("PolyhullDepthMetaAPI");
    const bool attached = api != 0 && gst_buffer_get_meta(out, api) != nullptr;
    sound = sound && (api == 0 || gst_buffer_get_meta(held, api) == nullptr) &&
            gst_buffer_peek_memory(out, 0) == gst_buffer_peek_memory(held, 0);
    gst_buffer_unref(out);
    gst_buffer_unref(held);
    return attached;
  }
  GstFlowReturn push(std::int64_t time, const std::string& timecode = "") {
    GstBuffer* buffer = gst_buffer_new_memdup("xxxx", 4);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(time);
    mark(buffer, timecode);
    return gst_pad_push(depths.pad, buffer);
  }

  GstElement* element;
  GstHarness* frames;
  PosePusher messages, depths;
  bool sound = true;
};

}  // namespace

ELEMENT_TEST(test_near_things_hide) {
  const std::string messages = write_messages("near.jsonl", 3, 0.5);
  const Result open = composited(messages, "");
  fail_unless(open.changed > 100, "%" G_GUINT64_FORMAT, open.changed);
  for (const char* format : {"GRAY16_LE", "GRAY16_BE"}) {
    const Result hidden = composited(messages, depth_of("white", format));
    fail_unless_equals_uint64(hidden.changed, 0);
    fail_unless_equals_uint64(hidden.without, 0);
    fail_unless_equals_uint64(composited(messages, depth_of("white", format), "backend=gl").changed,
                              0);
    // Video that composite itself converts keeps its depth.
    for (const auto& [depth, changed] : {std::pair{"white", guint64{0}}, {"black", open.changed}})
      fail_unless_equals_uint64(
          composited(messages, depth_of(depth, format), "backend=processor", "NV12").changed,
          changed);
    // Black is eight metres away, or nothing.
    fail_unless_equals_uint64(composited(messages, depth_of("black", format)).changed,
                              open.changed);
  }
  // The upper half of the picture, white and black in 16 bits.
  const std::filesystem::path path = folder.file("half.gray16");
  {
    std::ofstream out(path, std::ios::binary);
    for (int frame = 0; frame < 3; ++frame)
      out << std::string(48 * 16 * 2, '\xff') << std::string(48 * 16 * 2, '\0');
  }
  const Result half = composited(
      messages,
      "filesrc location=" + path.string() +
          " ! rawvideoparse format=gray16-le width=48 height=32 framerate=25/1 ! t.depth");
  fail_unless(half.changed > open.changed / 5 && half.changed < open.changed * 4 / 5,
              "%" G_GUINT64_FORMAT " of %" G_GUINT64_FORMAT, half.changed, open.changed);
}

ELEMENT_TEST(test_without_measure_or_frames) {
  const std::string unmeasured = write_messages("unmeasured.jsonl", 3, 0.0);
  const Result open = composited(unmeasured, "");
  const Result ignored = composited(unmeasured, depth_of("white"));
  fail_unless_equals_uint64(ignored.changed, open.changed);
  fail_unless_equals_uint64(ignored.without, 3);
  const std::string messages = write_messages("near.jsonl", 3, 0.5);
  fail_unless_equals_uint64(composited(messages, depth_of("white", "GRAY16_LE", 1)).without, 2);
}

ELEMENT_TEST(test_frames_find_each_other) {
  Bench bench(true);
  for (int i : {0, 1, 2, 5}) fail_unless_equals_int(bench.push(40 * ms * i), GST_FLOW_OK);
  fail_unless(bench.send(0));
  fail_unless(bench.send(40 * ms + 19 * ms));
  fail_unless(!bench.send(120 * ms));  // dropped on the way
  fail_unless(bench.send(200 * ms));
  fail_unless_equals_uint64(statistic(bench.element, "frames-without-depth"), 1);
  fail_unless_equals_int(bench.depths.push("xxxx", GST_CLOCK_TIME_NONE), GST_FLOW_OK);
  fail_unless_equals_uint64(statistic(bench.element, "depth-frames-unmatchable"), 1);
  // One that is cut short is an error of its maker's; it is not read beyond its end.
  fail_unless_equals_int(bench.depths.push("x", 240 * ms), GST_FLOW_OK);
  fail_unless(!bench.send(240 * ms));
  fail_unless_equals_uint64(statistic(bench.element, "depth-frames-unusable"), 1);
  bench.close();
}

ELEMENT_TEST(test_nearest_frame) {
  Bench bench(true);
  const auto rate = [&](const char* of) {
    GstCaps* caps = gst_caps_from_string(
        (std::string("video/x-raw,format=GRAY16_BE,width=2,height=1,framerate=") + of).c_str());
    gst_pad_push_event(bench.depths.pad, gst_event_new_caps(caps));
    gst_caps_unref(caps);
  };
  // Of depth at twice the rate the one before is not the frame's, whose own is yet to come.
  rate("50/1");
  bench.push(20 * ms);
  fail_unless(!bench.send(40 * ms));
  bench.push(40 * ms);
  fail_unless(bench.send(40 * ms));
  // At a rate that nobody knows the nearest is taken, and those of before are gone.
  rate("0/1");
  bench.push(385 * ms);
  bench.push(400 * ms);
  fail_unless(bench.send(400 * ms));
  fail_unless(!bench.send(375 * ms));
  bench.close();
}

// Live frames that nothing matches give back their memory.
ELEMENT_TEST(test_live_frames_do_not_pile_up) {
  Bench bench(true);
  GstCaps* caps =
      gst_caps_from_string("video/x-raw,format=GRAY16_BE,width=4096,height=4096,framerate=25/1");
  gst_pad_push_event(bench.depths.pad, gst_event_new_caps(caps));
  gst_caps_unref(caps);
  static std::atomic<int> alive;
  alive = 0;
  for (int i = 0; i < 30; ++i) {
    GstBuffer* buffer = gst_buffer_new();
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(40 * ms * i);
    ++alive;
    gst_mini_object_weak_ref(
        GST_MINI_OBJECT_CAST(buffer), [](gpointer, GstMiniObject*) { --alive; }, nullptr);
    fail_unless_equals_int(gst_pad_push(bench.depths.pad, buffer), GST_FLOW_OK);
  }
  fail_unless_equals_int(alive, 8);  // of 32 MiB
  bench.close();
}

ELEMENT_TEST(test_files_wait_for_each_other) {
  Bench bench(false);
  int pushed = 0;
  std::thread depth([&] {
    for (int i = 0; i < 12; ++i) pushed += bench.push(40 * ms * i) == GST_FLOW_OK;
  });
  for (int i = 0; i < 12; ++i) fail_unless(bench.send(40 * ms * i), "frame %d", i);
  depth.join();
  fail_unless_equals_int(pushed, 12);
  fail_unless_equals_uint64(statistic(bench.element, "frames-without-depth"), 0);
  bench.close();
}

// What is sought as a segment ends without an end of stream, until another begins.
ELEMENT_TEST(test_segment_that_is_done) {
  Bench bench(false);
  for (int i = 0; i < 3; ++i) fail_unless_equals_int(bench.push(40 * ms * i), GST_FLOW_OK);
  for (GstPad* pad : {bench.depths.pad, bench.messages.pad})
    gst_pad_push_event(pad, gst_event_new_segment_done(GST_FORMAT_TIME, 120 * ms));
  for (int i = 0; i < 30; ++i) fail_unless(bench.send(40 * ms * i) == (i < 3), "frame %d", i);
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_pad_push_event(bench.depths.pad, gst_event_new_segment(&segment));
  bool attached = false;
  std::thread frame([&] { attached = bench.send(1200 * ms); });
  g_usleep(20000);
  fail_unless_equals_int(bench.push(1200 * ms), GST_FLOW_OK);
  frame.join();
  fail_unless(attached);
  bench.close();
}

/// Timecodes that go over midnight and then back to an earlier hour, and on to a later one.
std::string jumping_timecode(int i) {
  if (i < 50)
    return (i < 25 ? "23:59:59:" : "00:00:00:") + std::string(i % 25 < 10 ? "0" : "") +
           std::to_string(i % 25);
  char text[64];
  std::snprintf(text, sizeof text, "%02d:00:%02d:%02d",
                i < 150   ? 21
                : i < 250 ? 17
                          : 20,
                i % 50 / 25, i % 25);
  return text;
}

ELEMENT_TEST(test_timecodes_jump) {
  constexpr int count = 350;
  {
    Bench bench(false, "timecode");
    int pushed = 0;
    std::thread depth([&] {
      for (int i = 0; i < count; ++i)
        if (i != 24)  // lost just before midnight
          pushed += bench.push(40 * ms * i, jumping_timecode(i)) == GST_FLOW_OK;
      gst_pad_push_event(bench.depths.pad, gst_event_new_eos());
    });
    gst_pad_push_event(bench.messages.pad, gst_event_new_eos());
    for (int i = 0; i < count; ++i) {
      if (i >= 146 && i < 150) {  // lost just before a jump back, with as much depth as may wait
        for (int tries = 0; tries < 5000 && statistic(bench.element, "depth-frames") < 149; ++tries)
          g_usleep(1000);
        continue;
      }
      bench.send(40 * ms * i, jumping_timecode(i));
    }
    depth.join();
    fail_unless_equals_int(pushed, count - 1);
    fail_unless_equals_uint64(statistic(bench.element, "frames-without-depth"), 1);
    bench.close();
  }
  // Live, the depth a little after each frame.
  Bench bench(true, "timecode");
  g_object_set(bench.element, "scene-wait", guint64{10 * GST_SECOND}, nullptr);
  gst_pad_push_event(bench.messages.pad, gst_event_new_eos());
  for (int i = 0; i < count; ++i) {
    if (i == 149) {  // a frame is lost just before a jump
      fail_unless_equals_int(bench.push(40 * ms * i, jumping_timecode(i)), GST_FLOW_OK);
      continue;
    }
    if (i % 3 == 0) {  // or before it
      fail_unless_equals_int(bench.push(40 * ms * i, jumping_timecode(i)), GST_FLOW_OK);
      bench.send(40 * ms * i, jumping_timecode(i));
      continue;
    }
    std::thread frame([&] { bench.send(40 * ms * i, jumping_timecode(i)); });
    g_usleep(2000);
    fail_unless_equals_int(bench.push(40 * ms * i, jumping_timecode(i)), GST_FLOW_OK);
    frame.join();
  }
  fail_unless_equals_uint64(statistic(bench.element, "frames-without-depth"), 0);
  bench.close();
}

// A depth that is silent is waited for a second long, and again when it is back.
ELEMENT_TEST(test_silent_depth_is_lost) {
  for (const bool live : {true, false}) {
    Bench bench(live, "stream-time", true);
    GstBus* bus = gst_bus_new();
    gst_element_set_bus(bench.element, bus);
    gst_pad_push_event(bench.messages.pad, gst_event_new_eos());
    fail_unless_equals_int(bench.push(0), GST_FLOW_OK);
    bench.send(0);
    for (int i = 1; i < 60; ++i) bench.send(40 * ms * i);
    fail_unless_equals_uint64(statistic(bench.element, "depth-losses"), 1);
    fail_unless_equals_int(warnings_on(bus).size(), 1);
    // Waiting would take longer than the test may.
    g_object_set(bench.element, "scene-wait", guint64{10 * GST_SECOND}, nullptr);
    for (int i = 60; i < 72; ++i) bench.send(40 * ms * i);
    fail_unless_equals_int(bench.push(40 * ms * 72), GST_FLOW_OK);
    bench.send(40 * ms * 72);
    std::thread frame([&] { bench.send(40 * ms * 73); });
    g_usleep(20000);
    fail_unless_equals_int(bench.push(40 * ms * 73), GST_FLOW_OK);
    frame.join();
    fail_unless_equals_uint64(statistic(bench.element, "depth-losses"), 1);
    fail_unless_equals_uint64(statistic(bench.element, "frames-without-depth"), 71);
    gst_element_set_bus(bench.element, nullptr);
    gst_object_unref(bus);
    bench.close();
  }
}

ELEMENT_TEST(test_states) {
  check_states(
      "filesrc location=" + write_messages("states.jsonl", 1000, 0.5) +
          " ! t.scene videotestsrc ! video/x-raw,format=GRAY16_LE ! t.depth videotestsrc ! "
          "trackstamp name=t scene-match=stream-time ! fakesink",
      20);
}
