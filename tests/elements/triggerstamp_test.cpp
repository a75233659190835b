// SPDX-License-Identifier: LGPL-2.1-or-later
// Pulses and the frames that answer them, through pipelines; and pulses for sets that have left.
#include <atomic>
#include <memory>
#include <thread>

#include "element_checks.h"
#include "support/triggered_line.h"

using namespace polyhull::test;

namespace {

constexpr guint64 none = ~guint64{0};

std::uint64_t numbered(const std::vector<StampedFrame>& frames) {
  std::uint64_t count = 0;
  for (const StampedFrame& frame : frames) {
    if (frame.number == none) continue;
    fail_unless_equals_uint64(frame.number, frame.pulse);
    ++count;
  }
  return count;
}

std::string refusal(const std::string& line) {
  GstElement* pipeline = parse(line);
  std::string text = "it was not refused";
  if (gst_element_set_state(pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    text = wait_for_end(pipeline, GST_SECOND);
  stop(pipeline);
  return text;
}

void expect_in(const std::string& text, const char* part) {
  fail_unless(text.find(part) != std::string::npos, "\"%s\" is not in \"%s\"", part, text.c_str());
}

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("triggerstamp");
}

// Every pulse of a busy machine has its frame, and every frame its pulse's number.
ELEMENT_TEST(test_one_to_one_under_load) {
  std::atomic<bool> stop{false};
  std::vector<std::thread> load;
  for (int i = 0; i < 4; ++i)
    load.emplace_back([&stop] {
      for (volatile double x = 1.0; !stop;) x = x * 1.0000001;
    });
  {
    TriggeredOptions options;
    options.cameras = 3;
    options.trigger = "rate=60/1 pulse=1000000";
    options.stamp = "delay=2000000 window=6000000";
    options.jitter = 1500000;
    options.transfer = 40000000;  // more than two periods
    TriggeredLine line(options);
    line.play();
    fail_unless(line.wait_for_pulses(100));
    line.finish();
    const guint64 pulses = statistic(line.element("trigger"), "pulses");
    fail_unless_equals_uint64(line.pulses(), pulses);
    const double p99 = figure(line.element("trigger"), "p99-lateness-us");
    fail_unless(p99 > 0.0 && p99 <= figure(line.element("trigger"), "largest-lateness-us"));
    for (int camera = 0; camera < 3; ++camera) {
      const auto frames = line.frames(camera);
      fail_unless_equals_uint64(frames.size(), pulses);
      fail_unless_equals_uint64(numbered(frames), pulses);
      GstElement* stamp = line.element("stamp" + std::to_string(camera));
      fail_unless_equals_uint64(statistic(stamp, "frames-numbered"), pulses);
      fail_unless_equals_uint64(statistic(stamp, "frames-unexplained"), 0);
      fail_unless_equals_uint64(statistic(stamp, "pulses-unanswered"), 0);
      const double delay = figure(stamp, "mean-delay-us");
      fail_unless(delay > 3500.0 && delay < 5500.0, "delay %f us", delay);
    }
  }
  stop = true;
  for (std::thread& thread : load) thread.join();
}

// Frames that are lost, sent twice or stray in: nothing is shifted, all is counted.
ELEMENT_TEST(test_lost_repeated_and_stray_frames) {
  TriggeredOptions options;
  options.trigger = "rate=50/1 pulse=1000000";
  options.stamp = "delay=3000000 window=4000000";
  options.frames = [](int, std::uint64_t pulse) {
    return pulse % 7 == 3 ? 0 : pulse % 5 == 1 ? 2 : 1;
  };
  TriggeredLine line(options);
  line.play();
  fail_unless(line.wait_for_pulses(60));
  const auto start = static_cast<std::int64_t>(gst_element_get_base_time(line.pipeline));
  line.finish();
  line.stray(0, start);  // before any pulse
  const guint64 pulses = line.pulses();
  guint64 lost = 0, twice = 0;
  for (guint64 i = 0; i < pulses; ++i) {
    if (options.frames(0, i) == 0) ++lost;
    if (options.frames(0, i) == 2) ++twice;
  }
  g_usleep(100000);
  GstElement* stamp = line.element("stamp0");
  fail_unless_equals_uint64(numbered(line.frames(0)), pulses - lost);
  fail_unless_equals_uint64(statistic(stamp, "frames-repeated"), twice);
  fail_unless_equals_uint64(statistic(stamp, "frames-unexplained"), 1);
  // That of the last pulse may not have been missed yet.
  const guint64 unanswered = statistic(stamp, "pulses-unanswered");
  fail_unless(unanswered + (options.frames(0, pulses - 1) == 0 ? 1 : 0) >= lost &&
              unanswered <= lost);
  GstBus* bus = gst_element_get_bus(line.pipeline);
  std::string words;
  for (const std::string& text : warnings_on(bus)) words += text;
  gst_object_unref(bus);
  expect_in(words, "has two frames");
  expect_in(words, "answers to no pulse: it has to come 3.0 to 7.0 ms after one");
}

// rigtestsrc numbers its frames itself.
ELEMENT_TEST(test_numbers_of_the_source_are_not_earned) {
  const Terminal terminal;
  GstElement* pipeline = parse("serialtrigger rate=0/1 device=" + terminal.device +
                               " rigtestsrc num-buffers=3 ! triggerstamp ! fakesink name=sink "
                               "signal-handoffs=true");
  GstElement* sink = named(pipeline, "sink");
  int frames = 0;
  g_signal_connect(
      sink, "handoff", G_CALLBACK(+[](GstElement*, GstBuffer* buffer, GstPad*, gpointer data) {
        ++*static_cast<int*>(data);
        fail_unless(gst_buffer_get_reference_timestamp_meta(buffer, nullptr) == nullptr);
      }),
      &frames);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  stop(pipeline);
  fail_unless_equals_int(frames, 3);
}

// A camera that says nothing has no frames for its pulses, and `stats` says so.
ELEMENT_TEST(test_silent_camera) {
  TriggeredOptions options;
  options.trigger = "rate=50/1 pulse=1000000";
  options.frames = [](int, std::uint64_t) { return 0; };
  TriggeredLine line(options);
  line.play();
  fail_unless(line.wait_for_pulses(20));
  line.finish();
  g_usleep(1100000);
  fail_unless_equals_uint64(statistic(line.element("stamp0"), "pulses-unanswered"), line.pulses());
  fail_unless(line.frames(0).empty());
}

// A window longer than the time between pulses earns no number.
ELEMENT_TEST(test_ambiguous_window) {
  TriggeredOptions options;
  options.trigger = "rate=50/1 pulse=1000000";
  options.stamp = "delay=0 window=45000000";
  TriggeredLine line(options);
  line.play();
  fail_unless(line.wait_for_pulses(20));
  line.finish();
  fail_unless(numbered(line.frames(0)) <= 2);  // the first have one pulse before them
  fail_unless(statistic(line.element("stamp0"), "frames-ambiguous") >= 18);
}

// With fire-on=composited each set that leaves brings the next pulse; one lost is got over.
ELEMENT_TEST(test_fires_when_the_last_set_has_left) {
  TriggeredOptions options;
  options.trigger = "rate=100/1 pulse=1000000 fire-on=composited listen-to=last timeout=200000000";
  options.frames = [](int, std::uint64_t pulse) { return pulse == 10 ? 0 : 1; };
  options.tail =
      "identity sleep-time=20000 ! identity name=last ! fakesink name=sink%d sync=false "
      "signal-handoffs=true";
  TriggeredLine line(options);
  const gint64 begin = g_get_monotonic_time();
  line.play();
  fail_unless(line.wait_for_pulses(31));
  const double seconds = static_cast<double>(g_get_monotonic_time() - begin) * 1e-6;
  gst_element_set_state(line.pipeline, GST_STATE_PAUSED);
  fail_unless_equals_uint64(statistic(line.element("trigger"), "timeouts"), 1);
  // 29 sets of 24 ms and more, and one timeout of 200 ms: never two under way.
  fail_unless(seconds >= 29 * .024 + .2, "%f s", seconds);
  const auto frames = line.frames(0);
  fail_unless(numbered(frames) >= 29);
}

// The composite of the pipeline is found, and each set that it shows brings a pulse.
ELEMENT_TEST(test_fires_when_a_set_was_composited) {
  const Terminal terminal;
  std::string text =
      "serialtrigger name=trigger rate=0/1 fire-on=composited timeout=20000000000 "
      "device=" +
      terminal.device +
      " composite name=mix ! fakesink sync=true videotestsrc "
      "num-buffers=4 ! video/x-raw,format=RGBA,width=160,height=90,framerate=10/1 ! "
      "mix.background hullbuild name=hull ! mix.mesh_0";
  for (const char* camera : {"cam0", "cam1", "cam2", "cam3"})
    text += std::string(" rigtestsrc num-buffers=4 camera=") + camera +
            " ! video/x-raw,framerate=10/1 ! queue ! silhouette camera=" + camera + " ! hull.";
  GstElement* pipeline = parse(text);
  GstElement* mix = named(pipeline, "mix");
  GstElement* trigger = named(pipeline, "trigger");
  std::atomic<guint64> sets{0};
  g_signal_connect(mix, "composited", G_CALLBACK(+[](GstElement*, guint64, gpointer data) {
                     ++*static_cast<std::atomic<guint64>*>(data);
                   }),
                   &sets);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  g_usleep(50000);
  fail_unless_equals_uint64(sets, 4);
  // The first pulse comes by itself; the first set, which waits for PLAYING, may be before it.
  const guint64 pulses = statistic(trigger, "pulses");
  fail_unless(pulses == 4 || pulses == 5, "%" G_GUINT64_FORMAT " pulses", pulses);
  fail_unless_equals_uint64(statistic(trigger, "timeouts"), 0);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(pipeline);
}

// As fast as the rate allows, no faster.
ELEMENT_TEST(test_rate_limits_what_follows) {
  TriggeredOptions options;
  options.trigger = "rate=40/1 pulse=1000000 fire-on=composited listen-to=sink0";
  TriggeredLine line(options);
  const gint64 begin = g_get_monotonic_time();
  line.play();
  fail_unless(line.wait_for_pulses(21));
  fail_unless(g_get_monotonic_time() - begin >= 20 * 25000 - 1000);
  fail_unless_equals_uint64(statistic(line.element("trigger"), "timeouts"), 0);
}

ELEMENT_TEST(test_refusals) {
  const Terminal terminal, other;
  const std::string trigger = "serialtrigger device=" + terminal.device + " ";
  expect_in(refusal("videotestsrc ! triggerstamp ! fakesink"), "no serialtrigger in the pipeline");
  expect_in(refusal(trigger + "videotestsrc ! triggerstamp trigger=none ! fakesink"), "'none'");
  expect_in(refusal(trigger + "serialtrigger device=" + other.device +
                    " videotestsrc ! triggerstamp ! fakesink"),
            "more than one serialtrigger");
  expect_in(refusal(trigger + "fire-on=composited videotestsrc ! fakesink"),
            "no composite in the pipeline");
}

ELEMENT_TEST(test_states) {
  const Terminal terminal;
  check_states("serialtrigger device=" + terminal.device +
                   " fire-on=composited listen-to=stamp videotestsrc num-buffers=2 ! triggerstamp "
                   "name=stamp ! fakesink",
               15);
}
