// SPDX-License-Identifier: LGPL-2.1-or-later
// Views of cameras on other machines get the numbers of this machine's pulses.
#include <gst/app/gstappsrc.h>

#include <cstdlib>
#include <map>
#include <string>

#include "element_checks.h"
#include "gdp_stream.h"
#include "support/terminal.h"
#include "wire/mesh_payload.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

constexpr std::int64_t millisecond = 1'000'000;

const Packet& recorded() {
  static const GdpStream stream =
      record_before_checks("rigtestsrc camera=cam0 num-buffers=1 ! silhouette camera=cam0");
  return stream.payloads.front();
}
const bool is_recorded = before_cases([] { recorded(); });

struct Pulse {
  std::uint64_t number;
  std::int64_t time;  // ns, of the pipeline's clock
};

/// The next pulse that serialtrigger has told of on \p bus.
Pulse next_pulse(GstBus* bus) {
  while (GstMessage* message =
             gst_bus_timed_pop_filtered(bus, 20 * GST_SECOND, GST_MESSAGE_ELEMENT)) {
    const GstStructure* told = gst_message_get_structure(message);
    guint64 number = 0, time = 0;
    const bool pulse = gst_structure_has_name(told, "polyhull-trigger") &&
                       gst_structure_get_uint64(told, "number", &number) &&
                       gst_structure_get_uint64(told, "clock-time", &time);
    gst_message_unref(message);
    if (pulse) return {number, static_cast<std::int64_t>(time)};
  }
  ck_abort_msg("no pulse came");
  return {};
}

/// A trigger, and views that the test pushes and pulls.
struct Stamped {
  explicit Stamped(const std::string& before = "")
      : pipeline(parse("serialtrigger rate=25/1 pulse=1000000 device=" + terminal.device +
                       " appsrc name=in format=time caps=application/x-polyhull-view ! " + before +
                       "triggerstamp name=stamp delay=3000000 window=4000000 ! "
                       "appsink name=out sync=false async=false")),
        in(gst_bin_get_by_name(GST_BIN(pipeline), "in")),
        stamp(gst_bin_get_by_name(GST_BIN(pipeline), "stamp")),
        out(gst_bin_get_by_name(GST_BIN(pipeline), "out")),
        bus(gst_element_get_bus(pipeline)) {
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
  }
  ~Stamped() {
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(bus);
    gst_object_unref(out);
    gst_object_unref(stamp);
    gst_object_unref(in);
    gst_object_unref(pipeline);
  }
  void push(const Packet& bytes) {
    GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
    GST_BUFFER_PTS(buffer) = 40 * GST_MSECOND * pushed++;
    GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
    fail_unless_equals_int(gst_app_src_push_buffer(GST_APP_SRC(in), buffer), GST_FLOW_OK);
  }
  /// Pushes \p view and expects it back with \p number and nothing else changed.
  void expect(View view, std::uint64_t number) {
    push(write_view(view));
    GstSample* sample = gst_app_sink_try_pull_sample(GST_APP_SINK(out), 20 * GST_SECOND);
    fail_unless(sample != nullptr, "no view came");
    GstBuffer* buffer = gst_sample_get_buffer(sample);
    view.trigger = number;
    fail_unless(bytes_of(buffer) == write_view(view), "%s", statistics_text(stamp).c_str());
    fail_unless_equals_uint64(GST_BUFFER_PTS(buffer), 40 * GST_MSECOND * (pushed - 1));
    fail_unless_equals_uint64(GST_BUFFER_DURATION(buffer), 40 * GST_MSECOND);
    gst_sample_unref(sample);
  }
  Terminal terminal;
  GstElement *pipeline, *in, *stamp, *out;
  GstBus* bus;
  guint64 pushed = 0;
};

}  // namespace

ELEMENT_TEST(test_numbers) {
  Stamped line;
  View view = read_view(Bytes(recorded()));
  view.trigger = 77;  // the capture machine's own
  Pulse pulse{};
  for (int i = 0; i < 20; ++i) {
    pulse = next_pulse(line.bus);
    view.capture_time = pulse.time + 5 * millisecond;
    view.clock = i % 2 == 0 ? CaptureClock::arrival : CaptureClock::pipeline;
    line.expect(view, pulse.number);
  }
  line.expect(view, no_trigger);
  fail_unless_equals_uint64(statistic(line.stamp, "frames-repeated"), 1);
  pulse = next_pulse(line.bus);
  view.capture_time = pulse.time + millisecond;
  line.expect(view, no_trigger);
  fail_unless_equals_uint64(statistic(line.stamp, "frames-unexplained"), 1);
  for (const CaptureClock other : {CaptureClock::unix, CaptureClock::ptp}) {
    view.capture_time = pulse.time + 5 * millisecond;
    view.clock = other;
    line.expect(view, no_trigger);
  }
  view.capture_time = no_time;
  line.expect(view, no_trigger);
  fail_unless_equals_uint64(statistic(line.stamp, "frames-untimed"), 3);
  expect_warning(line.bus, "not of the pipeline's clock");
  fail_unless_equals_uint64(statistic(line.stamp, "frames-numbered"), 20);
  fail_unless_equals_uint64(statistic(line.stamp, "frames"), 25);
  // A view without pixels, as contourfind may send it.
  pulse = next_pulse(line.bus);
  view.capture_time = pulse.time + 5 * millisecond;
  view.clock = CaptureClock::arrival;
  view.roi = {};
  view.format = PixelFormat::none;
  view.stride = 0;
  view.pixels = {};
  line.expect(view, pulse.number);
}

// What is no view is left out, and the stream goes on.
ELEMENT_TEST(test_unusable) {
  Stamped line;
  View view = read_view(Bytes(recorded()));
  line.push({1, 2, 3});
  Packet cut = recorded();
  cut.pop_back();
  line.push(cut);
  wait_for_statistic(line.stamp, "views-unusable", 2);
  expect_warning(line.bus, "A view was left out");
  const Pulse pulse = next_pulse(line.bus);  // of other messages none is left behind it
  view.capture_time = pulse.time + 5 * millisecond;
  line.expect(view, pulse.number);

  Stamped packed("viewencode coding=lz4 ! ");
  packed.push(recorded());
  wait_for_statistic(packed.stamp, "views-unusable", 1);
  expect_warning(packed.bus, "Put viewdecode in front");
}

// Cameras of capture machines, over TCP: the server's sets meet by the numbers of its own pulses.
ELEMENT_TEST(test_over_the_network) {
  constexpr int cameras = 3;
  std::string captures, clients;
  for (int i = 0; i < cameras; ++i) {
    const std::string n = std::to_string(i);
    captures += "rigtestsrc is-live=true camera=cam" + n +
                " ! video/x-raw,framerate=5/1 ! silhouette trigger-from=none camera=cam" + n +
                " ! gdppay ! viewserversink name=server" + n + " host=127.0.0.1 port=0 ";
    clients += "viewclientsrc name=client" + n + " camera=cam" + n +
               " max-age=0 timeout=20000000000 ! triggerstamp name=stamp" + n +
               " delay=10000000 window=100000000 ! queue ! hull. ";
  }
  const Terminal terminal;
  GstElement* far = parse(captures);
  GstElement* near = parse(
      "serialtrigger rate=5/1 pulse=1000000 device=" + terminal.device +
      " hullbuild name=hull rig=" + std::getenv("POLYHULL_SOURCE") +
      "/pipelines/rigs/five.json max-wait=20000000000 ! appsink name=out sync=false " + clients);
  // As two machines have it that share a clock.
  g_autoptr(GstClock) clock = gst_system_clock_obtain();
  for (GstElement* pipeline : {far, near}) gst_pipeline_use_clock(GST_PIPELINE(pipeline), clock);
  gst_element_set_state(far, GST_STATE_PAUSED);
  for (int i = 0; i < cameras; ++i) {
    const std::string n = std::to_string(i);
    g_autoptr(GstElement) server = gst_bin_get_by_name(GST_BIN(far), ("server" + n).c_str());
    g_autoptr(GstElement) client = gst_bin_get_by_name(GST_BIN(near), ("client" + n).c_str());
    g_object_set(client, "port", static_cast<guint>(statistic(server, "port")), nullptr);
  }
  gst_element_set_state(near, GST_STATE_PLAYING);
  g_autoptr(GstBus) bus = gst_element_get_bus(near);
  std::map<std::uint64_t, std::int64_t> pulses;
  const Pulse first = next_pulse(bus);
  pulses[first.number] = first.time;
  // These cameras run by themselves: as if each pulse were answered 60 ms later.
  gst_element_set_start_time(far, GST_CLOCK_TIME_NONE);
  gst_element_set_base_time(far, static_cast<GstClockTime>(first.time + 60 * millisecond));
  gst_element_set_state(far, GST_STATE_PLAYING);

  g_autoptr(GstElement) out = gst_bin_get_by_name(GST_BIN(near), "out");
  std::uint64_t last = 0;
  for (int i = 0; i < 5; ++i) {
    GstSample* sample = gst_app_sink_try_pull_sample(GST_APP_SINK(out), 60 * GST_SECOND);
    fail_unless(sample != nullptr, "no hull came");
    const Packet bytes = bytes_of(gst_sample_get_buffer(sample));
    gst_sample_unref(sample);
    const Mesh mesh = read_mesh(Bytes(bytes));
    fail_if(mesh.trigger == no_trigger);
    fail_unless(i == 0 || mesh.trigger > last);
    last = mesh.trigger;
    while (!pulses.contains(last)) {
      const Pulse pulse = next_pulse(bus);
      pulses[pulse.number] = pulse.time;
    }
    const std::int64_t after = mesh.capture_time - pulses[last];
    fail_unless(after >= 10 * millisecond && after <= 110 * millisecond, "%f ms after its pulse",
                1e-6 * static_cast<double>(after));
    // It is still when the far cameras took it.
    const std::int64_t taken = mesh.capture_time - first.time - 60 * millisecond;
    fail_unless_equals_int64(taken % (200 * millisecond), 0);
  }
  for (GstElement* pipeline : {far, near}) gst_element_set_state(pipeline, GST_STATE_NULL);
  for (int i = 0; i < cameras; ++i) {
    g_autoptr(GstElement) stamp =
        gst_bin_get_by_name(GST_BIN(near), ("stamp" + std::to_string(i)).c_str());
    fail_unless_equals_uint64(statistic(stamp, "frames-numbered"), statistic(stamp, "frames"));
  }
  gst_object_unref(far);
  gst_object_unref(near);
}
