// SPDX-License-Identifier: LGPL-2.1-or-later
// Cameras' own times on the pipeline's clock.
#include <gst/check/gstharness.h>
#include <gst/check/gsttestclock.h>

#include "element_checks.h"

using namespace polyhull::test;

namespace {

constexpr GstClockTime frame = 40 * GST_MSECOND;

/// An element on a clock that the test sets; its frames come as of a camera whose times begin at 0.
struct Bench {
  explicit Bench(const char* line = "steadystamp") : harness(gst_harness_new_parse(line)) {
    gst_harness_set_src_caps_str(harness, "video/x-raw,format=GRAY8,width=4,height=4");
    gst_harness_use_testclock(harness);
    element = gst_harness_find_element(harness, "steadystamp");
  }
  ~Bench() {
    gst_object_unref(element);
    gst_harness_teardown(harness);
  }

  /// The time that the frame of the camera's time \p time gets when it comes at \p arrival; none: it
  /// goes no further.
  GstClockTime push(GstClockTime time, GstClockTime arrival) {
    gst_harness_set_time(harness, arrival);
    GstBuffer* buffer = gst_harness_create_buffer(harness, 16);
    GST_BUFFER_PTS(buffer) = time;
    fail_unless_equals_int(gst_harness_push(harness, buffer), GST_FLOW_OK);
    GstBuffer* out = gst_harness_try_pull(harness);
    if (out == nullptr) return GST_CLOCK_TIME_NONE;
    const GstClockTime stamped = GST_BUFFER_PTS(out);
    gst_buffer_unref(out);
    return stamped;
  }

  GstHarness* harness;
  GstElement* element;
};

}  // namespace

ELEMENT_TEST(test_documented) {
  check_documented("steadystamp");
}

ELEMENT_TEST(test_frames_that_were_held_up_have_their_time) {
  Bench bench;
  for (guint64 i = 0; i < 50; ++i) {
    // Every third frame comes 25 ms late, but not the camera's first second's first.
    const GstClockTime taken = 5 * GST_SECOND + i * frame;
    const GstClockTime arrival = taken + (i % 3 == 2 ? 25 * GST_MSECOND : 0);
    const GstClockTime time = bench.push(i * frame, arrival);
    if (i * frame < GST_SECOND / 2) {
      fail_if(GST_CLOCK_TIME_IS_VALID(time), "frame %d passed", static_cast<int>(i));
      continue;
    }
    fail_unless(GST_CLOCK_DIFF(taken, time) >= 0 && GST_CLOCK_DIFF(taken, time) < 20000,
                "frame %d is off by %d ns", static_cast<int>(i),
                static_cast<int>(GST_CLOCK_DIFF(taken, time)));
  }
  fail_unless_equals_uint64(statistic(bench.element, "frames"), 50);
  fail_unless_equals_uint64(statistic(bench.element, "frames-settling"), 13);
  fail_unless_equals_uint64(statistic(bench.element, "clock-restarts"), 0);
  const double delay = figure(bench.element, "delay-ms");
  fail_unless(delay > 4999.9 && delay < 5000.1, "%g ms", delay);
}

ELEMENT_TEST(test_begins_anew) {
  Bench bench("steadystamp settle=0");
  GstBus* bus = gst_bus_new();
  gst_element_set_bus(bench.element, bus);
  fail_unless_equals_uint64(bench.push(0, 2 * GST_SECOND), 2 * GST_SECOND);
  fail_unless_equals_uint64(bench.push(40 * GST_SECOND, 42 * GST_SECOND), 42 * GST_SECOND);
  // The camera was started again: a warning says so.
  fail_unless_equals_uint64(bench.push(0, 50 * GST_SECOND), 50 * GST_SECOND);
  fail_unless_equals_uint64(statistic(bench.element, "clock-restarts"), 1);
  fail_unless_equals_uint64(warnings_on(bus).size(), 1);
  // After a flush nothing is known, and nothing is said.
  gst_harness_push_event(bench.harness, gst_event_new_flush_start());
  gst_harness_push_event(bench.harness, gst_event_new_flush_stop(FALSE));
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_harness_push_event(bench.harness, gst_event_new_segment(&segment));
  fail_unless_equals_uint64(bench.push(0, 60 * GST_SECOND), 60 * GST_SECOND);
  fail_unless_equals_uint64(statistic(bench.element, "clock-restarts"), 1);
  // A frame without a time passes as it is.
  fail_if(GST_CLOCK_TIME_IS_VALID(bench.push(GST_CLOCK_TIME_NONE, 61 * GST_SECOND)));
  fail_unless_equals_uint64(statistic(bench.element, "frames-untimed"), 1);
  fail_unless_equals_uint64(statistic(bench.element, "frames-settling"), 0);
  gst_element_set_bus(bench.element, nullptr);
  gst_object_unref(bus);
}

/// A test source that counts as aravissrc, in place of one that is installed.
void register_camera() {
  GstElementFactory* factory = gst_element_factory_find("videotestsrc");
  gst_object_unref(gst_object_ref_sink(gst_element_factory_create(factory, nullptr)));  // loads it
  GTypeQuery parent;
  g_type_query(g_type_from_name("GstVideoTestSrc"), &parent);
  const GType type =
      g_type_register_static_simple(parent.type, "TestAravisSrc", parent.class_size, nullptr,
                                    parent.instance_size, nullptr, static_cast<GTypeFlags>(0));
  fail_unless(gst_element_register(nullptr, "aravissrc", GST_RANK_NONE, type));
  gst_object_unref(factory);
}

// aravissrc would hold its frames back by its clock, which each start of the pipeline gives it.
ELEMENT_TEST(test_aravissrc_sends_at_once) {
  register_camera();
  for (const bool timestamps : {false, true}) {
    GstElement* pipeline = gst_parse_launch(
        timestamps ? "aravissrc name=camera is-live=true do-timestamp=true ! identity ! "
                     "steadystamp ! fakesink"
                   : "aravissrc name=camera is-live=true ! identity ! steadystamp ! fakesink",
        nullptr);
    GstElement* camera = named(pipeline, "camera");
    for (int start = 0; start < 2; ++start) {
      gst_element_set_state(pipeline, GST_STATE_PLAYING);
      fail_unless_equals_int(gst_element_get_state(pipeline, nullptr, nullptr, 10 * GST_SECOND),
                             GST_STATE_CHANGE_SUCCESS);
      GstClock* clock = gst_element_get_clock(camera);
      fail_unless((clock != nullptr) == timestamps);
      if (clock != nullptr) gst_object_unref(clock);
      gst_element_set_state(pipeline, GST_STATE_PAUSED);
    }
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}

ELEMENT_TEST(test_states) {
  check_states("rigtestsrc num-buffers=3 is-live=true ! steadystamp settle=0 ! fakesink", 10);
}
