// SPDX-License-Identifier: LGPL-2.1-or-later
// Which views belong together where trigger numbers do not say: timecodes, capture times, clocks that
// jump; and what is told of the sets' times.
#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include "element_test.h"
#include "hull_bench.h"
#include "support/labels.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::int64_t frame_ns = frame_time;
constexpr std::int64_t hour = 3600 * static_cast<std::int64_t>(GST_SECOND);
constexpr std::int64_t far = 1000 * hour;  // nothing to do with this pipeline's clock

/// A view without trigger number.
struct Timed {
  std::int64_t capture = no_time;
  CaptureClock clock = CaptureClock::ptp;
  std::int64_t timecode = no_time;
};

void push_timed(Bench& bench, int camera, GstClockTime running, const Timed& times) {
  std::vector<std::uint8_t> pixels;
  View view = box_view(bench.rig.cameras[camera], {}, 0, pixels);
  view.trigger = no_trigger;
  view.capture_time = times.capture;
  view.clock = times.clock;
  view.timecode = times.timecode;
  bench.push(camera, view, running);
}

/// Camera i's views come with running times \p ahead[i] ahead of the first's.
constexpr GstClockTime ahead[] = {0, 1 * GST_SECOND, 3 * GST_SECOND};

bool warned(const std::vector<std::string>& warnings, std::initializer_list<const char*> parts) {
  return std::any_of(warnings.begin(), warnings.end(), [&](const std::string& text) {
    return std::all_of(parts.begin(), parts.end(),
                       [&](const char* part) { return text.find(part) != std::string::npos; });
  });
}

}  // namespace

ELEMENT_TEST(capture_times_match_branches_started_seconds_apart) {
  Bench bench("", 3);
  for (int i = 0; i < 10; ++i) {
    for (int c = 0; c < 3; ++c)
      push_timed(bench, c, i * frame_time + ahead[c], {far + i * frame_ns + c * 1000000});
    const auto mesh = bench.pull();
    fail_unless_equals_int(mesh->views.size(), 3);
    fail_unless_equals_uint64(GST_BUFFER_PTS(bench.last.get()), i * frame_time);
    fail_unless_equals_int64(mesh->capture_time, far + i * frame_ns);
    fail_unless(mesh->views[1].view.clock == CaptureClock::ptp);
  }
  fail_unless_equals_uint64(bench.count("sets-by-capture-time"), 10);
  fail_unless_equals_uint64(bench.count("sets-incomplete"), 0);
  // The capture times are 0, 1 and 2 ms apart.
  for (const char* field : {"spread-minimum-us", "spread-median-us", "spread-maximum-us"})
    fail_unless(figure(bench.element, field) == 2000.0, "%s %g", field,
                figure(bench.element, field));
  fail_unless(figure(bench.element, "offset-us-cam2") == 1000.0);
  fail_unless(bench.warnings().empty());
}

ELEMENT_TEST(timecodes_come_before_capture_times) {
  Bench bench("", 3);
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 3; ++c)
      push_timed(bench, c, i * frame_time + ahead[c],
                 {far + i * frame_ns + c * 20000000, CaptureClock::ptp, hour + i * frame_ns});
    fail_unless_equals_int(bench.pull()->views.size(), 3);
  }
  fail_unless_equals_uint64(bench.count("sets-by-timecode"), 5);
}

ELEMENT_TEST(trigger_numbers_come_before_all) {
  Bench bench("", 2);
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 2; ++c) {
      std::vector<std::uint8_t> pixels;
      View view = box_view(bench.rig.cameras[c], {}, i, pixels);
      view.capture_time = far + i * frame_ns + c * 30000000;
      view.clock = CaptureClock::ptp;
      bench.push(c, view, i * frame_time + ahead[c]);
    }
    fail_unless_equals_int(bench.pull()->views.size(), 2);
  }
  fail_unless_equals_uint64(bench.count("sets-by-trigger"), 5);
}

/// Files that say no times have those of their frames' places, which is nothing to warn of.
ELEMENT_TEST(running_times_are_the_last_resort_and_said) {
  struct Case {
    bool live, one_tells;
    std::size_t warnings;
  };
  for (const Case& each : {Case{true, false, 1}, {false, true, 1}, {false, false, 0}}) {
    Bench bench("", 2, each.live);
    for (int i = 0; i < 5; ++i) {
      for (int c = 0; c < 2; ++c)
        push_timed(bench, c, i * frame_time + c * GST_MSECOND,
                   {each.one_tells && c == 1 ? far + i * frame_ns : no_time});
      fail_unless_equals_int(bench.pull()->views.size(), 2);
    }
    fail_unless_equals_uint64(bench.count("sets-by-running-time"), 5);
    const auto warnings = bench.warnings();
    fail_unless_equals_int(warnings.size(), each.warnings);
    if (!warnings.empty()) expect_in(warnings[0], {"matched by running time", "PTP"});
  }
}

ELEMENT_TEST(clocks_that_nobody_set_are_named) {
  Bench bench("", 2);
  for (int i = 0; i < 5; ++i) {
    for (int c = 0; c < 2; ++c)
      push_timed(bench, c, i * frame_time, {far + c * hour + i * frame_ns});
    fail_unless_equals_int(bench.pull()->views.size(), 2);
  }
  fail_unless_equals_uint64(bench.count("clocks-apart"), 1);
  fail_unless_equals_uint64(bench.count("sets-by-running-time"), 5);
  fail_unless(warned(bench.warnings(), {"clocks of cameras", "sink_1", "sink_0"}));
}

ELEMENT_TEST(a_clock_that_jumps_by_an_hour_stops_nobody) {
  Bench bench("", 3);
  for (int i = 0; i < 30; ++i) {
    for (int c = 0; c < 3; ++c)
      push_timed(bench, c, i * frame_time + ahead[c],
                 {far + i * frame_ns + (c == 1 && i >= 10 && i < 20 ? hour : 0)});
    fail_unless_equals_int(bench.pull()->views.size(), 3);
  }
  fail_unless_equals_uint64(bench.count("clock-jumps"), 2);
  fail_unless_equals_uint64(bench.count("clock-jumps-cam1"), 2);
  fail_unless_equals_uint64(bench.count("clock-jumps-cam0"), 0);
  fail_unless(warned(bench.warnings(), {"clock of camera cam1 has jumped by +3600.000 s"}));
}

ELEMENT_TEST(a_camera_that_is_steadily_late_is_named) {
  Bench bench("sync-tolerance=8000000", 3);
  // 3 ms of 8: within the tolerance, beyond a quarter of it; after 1.2 s it is right again.
  const auto run = [&](int begin, int end, std::int64_t late) {
    for (int i = begin; i < end; ++i) {
      for (int c = 0; c < 3; ++c)
        push_timed(bench, c, i * frame_time, {far + i * frame_ns + (c == 2 ? late : 0)});
      bench.pull();
    }
  };
  run(0, 30, 3000000);
  run(30, 200, 0);
  fail_unless(bench.warnings().empty());
  run(200, 360, 3000000);
  const auto warnings = bench.warnings();
  fail_unless_equals_int(warnings.size(), 1);
  expect_in(warnings[0], {"cam2", "3.00 ms after", "8.00 ms"});
  run(360, 400, 3000000);
  fail_unless(bench.warnings().empty());
}

ELEMENT_TEST(what_is_of_no_use_is_counted_per_camera) {
  Bench bench("", 3);
  for (int c = 0; c < 3; ++c) push_timed(bench, c, GST_SECOND, {far + 10 * frame_ns});
  bench.pull();
  push_timed(bench, 0, GST_SECOND, {far + 10 * frame_ns});              // twice
  push_timed(bench, 1, GST_SECOND - frame_time, {far + 9 * frame_ns});  // out of order
  push_timed(bench, 2, 0, {far + 10 * frame_ns - 3 * GST_SECOND / 2});  // before all began
  gst_harness_push(bench.inputs[0], gst_buffer_new_wrapped(g_strdup("no view"), 8));
  for (int c = 0; c < 3; ++c) push_timed(bench, c, 2 * GST_SECOND, {far + 35 * frame_ns});
  fail_unless_equals_int(bench.pull()->views.size(), 3);
  fail_unless_equals_uint64(bench.count("duplicate-views-cam0"), 1);
  fail_unless_equals_uint64(bench.count("late-views-cam1"), 1);
  fail_unless_equals_uint64(bench.count("early-views-cam2"), 1);
  fail_unless_equals_uint64(bench.count("views-early"), 1);
  fail_unless_equals_uint64(bench.count("unusable-views-cam0"), 1);
  fail_unless_equals_uint64(bench.count("late-views-cam0"), 0);
}

// A segment that begins at running time 10 s: what was taken before cannot be told in it.
ELEMENT_TEST(views_of_before_their_segment_are_early) {
  Bench bench("", 2);
  for (GstHarness* input : bench.inputs) {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    segment.base = 10 * GST_SECOND;
    fail_unless(gst_harness_push_event(input, gst_event_new_segment(&segment)));
  }
  for (int c = 0; c < 2; ++c) push_timed(bench, c, 0, {far});
  bench.pull();
  push_timed(bench, 1, frame_time, {far - 2 * frame_ns});
  for (int c = 0; c < 2; ++c) push_timed(bench, c, 2 * frame_time, {far + 2 * frame_ns});
  fail_unless_equals_int(bench.pull()->views.size(), 2);
  fail_unless_equals_uint64(bench.count("early-views-cam1"), 1);
  fail_unless_equals_uint64(bench.count("views-early"), 1);
}

// Their times may be any time apart.
ELEMENT_TEST(sets_by_trigger_name_no_camera_beside_the_others) {
  Bench bench("sync-tolerance=8000000", 2);
  for (int i = 0; i < 200; ++i) {
    for (int c = 0; c < 2; ++c) {
      std::vector<std::uint8_t> pixels;
      View view = box_view(bench.rig.cameras[c], {}, i, pixels);
      view.capture_time = far + i * frame_ns + c * 30000000;
      view.clock = CaptureClock::ptp;
      bench.push(c, view, i * frame_time);
    }
    fail_unless_equals_int(bench.pull()->views.size(), 2);
  }
  fail_unless_equals_uint64(bench.count("sets-by-trigger"), 200);
  fail_unless(bench.warnings().empty());
}

// By capture time alone: a missing view, one out of order, a camera that comes and goes.
ELEMENT_TEST(cameras_come_and_go_by_capture_time) {
  Bench bench("", 3);
  const auto push = [&](int camera, int i) {
    push_timed(bench, camera, i * frame_time + ahead[camera], {far + i * frame_ns});
  };
  for (int i = 0; i < 6; ++i) {
    for (int c = 0; c < 3; ++c)
      if (i != 3 || c != 1) push(c, i);
    if (i == 3) continue;  // known to lack camera 1 once that has sent the next
    if (i == 4) {
      fail_unless_equals_int(bench.pull()->views.size(), 2);
      fail_unless_equals_uint64(GST_BUFFER_PTS(bench.last.get()), 3 * frame_time);
    }
    fail_unless_equals_int(bench.pull()->views.size(), 3);
  }
  push(1, 3);  // late
  gst_harness_push_event(bench.inputs[2], gst_event_new_eos());
  for (int i = 6; i < 9; ++i) {
    for (int c = 0; c < 2; ++c) push(c, i);
    fail_unless_equals_int(bench.pull()->views.size(), 2);
  }
  fail_unless_equals_uint64(bench.count("late-views-cam1"), 1);
  fail_unless_equals_uint64(bench.count("sets-incomplete"), 4);
}

ELEMENT_TEST(views_of_dropped_sets_are_counted) {
  Bench bench("missing-camera=drop-set", 2);
  push_timed(bench, 0, 0, {far});
  push_timed(bench, 0, frame_time, {far + frame_ns});
  push_timed(bench, 1, frame_time, {far + frame_ns});
  bench.pull();
  fail_unless_equals_uint64(bench.count("given-up-views-cam0"), 1);
  fail_unless_equals_uint64(bench.count("given-up-views-cam1"), 0);
}

ELEMENT_TEST(a_message_tells_of_the_sets) {
  Bench bench("", 2);
  const auto told = [&] {
    guint64 sets = 0;
    int messages = 0;
    while (GstMessage* message = gst_bus_pop_filtered(bench.bus, GST_MESSAGE_ELEMENT)) {
      const GstStructure* fields = gst_message_get_structure(message);
      gdouble spread = -1.0;
      if (gst_structure_has_name(fields, "polyhull-sets")) {
        ++messages;
        fail_unless(gst_structure_get_uint64(fields, "sets", &sets));
        fail_unless(gst_structure_get_double(fields, "spread-maximum-us", &spread));
        fail_unless(spread == 500.0, "%g", spread);
      }
      gst_message_unref(message);
    }
    fail_unless(messages <= 6, "%d messages", messages);
    return sets;
  };
  for (int i = 0; i < 250; ++i) {
    for (int c = 0; c < 2; ++c)
      push_timed(bench, c, i * frame_time, {far + i * frame_ns + c * 500000});
    bench.pull();
  }
  fail_unless(told() >= 200);  // however fast they came
  g_usleep(1100000);
  for (int c = 0; c < 2; ++c)
    push_timed(bench, c, 250 * frame_time, {far + 250 * frame_ns + c * 500000});
  bench.pull();
  fail_unless_equals_uint64(told(), 251);
}

// ---- two pipelines of one process, started 1.5 s apart: 15 frames of 10 a second

namespace {

constexpr int frames_apart = 15;
constexpr GstClockTime slow_frame_time = 100 * GST_MSECOND;  // for a machine that is busy

struct Branch {
  GstElement* pipeline;
  GstElement* sink;
  GstElement* source = nullptr;  // of the pipeline with hullbuild
};

GstFlowReturn hand_over(GstAppSink* sink, gpointer camera) {
  GstSample* sample = gst_app_sink_pull_sample(sink);
  const GstFlowReturn flow =
      gst_app_src_push_sample(GST_APP_SRC(static_cast<Branch*>(camera)->source), sample);
  gst_sample_unref(sample);
  return flow;
}

Branch start_camera(int number, GstClock* clock, GstClockTime base) {
  const std::string name = "cam" + std::to_string(number);
  Branch camera;
  camera.pipeline = parse(
      "rigtestsrc stamp=true is-live=true camera=" + name +
      " shadow=0 unevenness=0 noise=0 spill=0 ! video/x-raw,framerate=10/1 ! silhouette camera=" +
      name + " trigger-from=none ! appsink name=out sync=false");
  camera.sink = gst_bin_get_by_name(GST_BIN(camera.pipeline), "out");
  gst_pipeline_use_clock(GST_PIPELINE(camera.pipeline), clock);
  gst_element_set_start_time(camera.pipeline, GST_CLOCK_TIME_NONE);
  gst_element_set_base_time(camera.pipeline, base);
  return camera;
}

}  // namespace

ELEMENT_TEST(pipelines_started_apart_make_whole_sets) {
  GstClock* clock = gst_system_clock_obtain();
  const GstClockTime base = gst_clock_get_time(clock);
  GstElement* hull = parse(
      "hullbuild name=hull min-cameras=2 ! appsink name=sets sync=false "
      "appsrc name=one is-live=true format=time caps=application/x-polyhull-view ! hull. "
      "appsrc name=two is-live=true format=time caps=application/x-polyhull-view ! hull. ");
  gst_pipeline_use_clock(GST_PIPELINE(hull), clock);
  gst_element_set_start_time(hull, GST_CLOCK_TIME_NONE);
  gst_element_set_base_time(hull, base + 400 * GST_MSECOND);
  Branch cameras[] = {start_camera(0, clock, base),
                      start_camera(1, clock, base + frames_apart * slow_frame_time)};
  GstAppSinkCallbacks callbacks{};
  callbacks.new_sample = hand_over;
  for (int i = 0; i < 2; ++i) {
    cameras[i].source = gst_bin_get_by_name(GST_BIN(hull), i == 0 ? "one" : "two");
    gst_app_sink_set_callbacks(GST_APP_SINK(cameras[i].sink), &callbacks, &cameras[i], nullptr);
  }
  gst_element_set_state(hull, GST_STATE_PLAYING);
  gst_element_set_state(cameras[0].pipeline, GST_STATE_PLAYING);
  g_usleep(1500000);
  gst_element_set_state(cameras[1].pipeline, GST_STATE_PLAYING);
  GstElement* sink = named(hull, "sets");
  int whole = 0;
  for (int i = 0; i < 30; ++i) {
    GstSample* sample = gst_app_sink_try_pull_sample(GST_APP_SINK(sink), 20 * GST_SECOND);
    fail_unless(sample != nullptr, "no set after %d", i);
    GstMapInfo map;
    GstBuffer* buffer = gst_sample_get_buffer(sample);
    gst_buffer_map(buffer, &map, GST_MAP_READ);
    const auto labels = labels_of(read_mesh(Bytes(map.data, map.size)));
    gst_buffer_unmap(buffer, &map);
    gst_sample_unref(sample);
    if (labels.size() != 2 || labels[0] < 0 || labels[1] < 0) continue;
    fail_unless(labels[0] - labels[1] == frames_apart, "frames %d and %d", labels[0], labels[1]);
    ++whole;
  }
  fail_unless(whole >= 10, "%d whole sets", whole);
  GstElement* builder = named(hull, "hull");
  fail_unless(statistic(builder, "sets-by-capture-time") > 0);
  for (Branch& camera : cameras) gst_element_set_state(camera.pipeline, GST_STATE_NULL);
  gst_element_set_state(hull, GST_STATE_NULL);
  for (Branch& camera : cameras) {
    gst_object_unref(camera.sink);
    gst_object_unref(camera.source);
    gst_object_unref(camera.pipeline);
  }
  gst_object_unref(hull);
  gst_object_unref(clock);
}
