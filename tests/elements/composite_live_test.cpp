// SPDX-License-Identifier: LGPL-2.1-or-later
// composite in real time: a frame leaves as soon as its mesh is there, whatever the phase between
// cameras and background, and the latency that it reports holds its work.
#include "composite_bench.h"

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <vector>

#include "element_test.h"
#include "support/run_kind.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

const bool in_time = !sanitized();

/// Times in ns.
struct Feed {
  int frames = 40;
  GstClockTime interval = 40 * GST_MSECOND;
  gint64 phase = 0;                          ///< of the meshes' times against the frames'
  GstClockTime length = 40 * GST_MSECOND;    ///< of a mesh; GST_CLOCK_TIME_NONE: it has none
  GstClockTime lateness = 25 * GST_MSECOND;  ///< a mesh comes so long after its time
  int pads = 1;
  std::vector<int> missing;  ///< meshes that do not come
};

/// Of one frame: when it left and when what it shows was there, and what drawing took; ms.
struct Left {
  double time = 0.0, work = 0.0;
};

struct LiveBench {
  explicit LiveBench(const Feed& with) : feed(with) {
    element = gst_element_factory_make_full("composite", "force-live", TRUE, "eye-y", 1.2, "eye-z",
                                            4.0, "target-y", 1.0, nullptr);
    gst_object_ref_sink(element);
    bus = gst_bus_new();
    gst_element_set_bus(element, bus);
    background = gst_harness_new_with_element(element, "background", "src");
    for (int i = 0; i < feed.pads; ++i) {
      meshes.push_back(gst_harness_new_with_element(element, "mesh_%u", nullptr));
      gst_harness_set_src_caps_str(meshes.back(), mesh_caps);
    }
    gst_harness_use_systemclock(background);
    GstClock* clock = gst_element_get_clock(element);
    gst_element_set_base_time(element, gst_clock_get_time(clock));
    gst_object_unref(clock);
    gst_harness_set_src_caps_str(background, background_caps);
    gst_pad_add_probe(background->sinkpad, GST_PAD_PROBE_TYPE_BUFFER, frame_leaves, this, nullptr);
    gst_harness_play(background);
  }
  ~LiveBench() {
    for (GstHarness* mesh : meshes) gst_harness_teardown(mesh);
    gst_harness_teardown(background);
    gst_element_set_bus(element, nullptr);
    gst_object_unref(bus);
    gst_object_unref(element);
  }

  /// Running time, ms.
  double now() const {
    GstClock* clock = gst_element_get_clock(element);
    const GstClockTime time = gst_clock_get_time(clock) - gst_element_get_base_time(element);
    gst_object_unref(clock);
    return 1e-6 * static_cast<double>(time);
  }

  static GstPadProbeReturn frame_leaves(GstPad*, GstPadProbeInfo* info, gpointer data) {
    auto* self = static_cast<LiveBench*>(data);
    const std::scoped_lock lock(self->mutex);
    const auto number = GST_BUFFER_PTS(GST_PAD_PROBE_INFO_BUFFER(info)) / self->feed.interval;
    if (number < self->left.size())
      self->left[number] = {self->now(), test::figure(self->element, "frame-ms")};
    return GST_PAD_PROBE_OK;
  }

  /// Pushes frames and meshes when they are due, until all frames have had their time.
  void run() {
    struct Event {
      gint64 due;
      int mesh, frame;  // -1: not that
    };
    std::vector<Event> events;
    const auto step = static_cast<gint64>(feed.interval);
    for (int i = 0; i < feed.frames; ++i) {
      events.push_back({step * i, -1, i});
      const gint64 time = step * i + feed.phase;
      if (time >= 0 && std::count(feed.missing.begin(), feed.missing.end(), i) == 0)
        events.push_back({time + static_cast<gint64>(feed.lateness), i, -1});
    }
    std::stable_sort(events.begin(), events.end(),
                     [](const Event& a, const Event& b) { return a.due < b.due; });
    subject();  // made when it is first needed, which takes its time
    left.resize(static_cast<std::size_t>(feed.frames));
    came.resize(left.size(), -1e9);
    shown.resize(left.size(), -1e9);
    for (const Event& event : events) {
      const double wait = 1e-6 * static_cast<double>(event.due) - now();
      if (wait > 0.0) g_usleep(static_cast<gulong>(1e3 * wait));
      if (event.frame >= 0) {
        shown[static_cast<std::size_t>(event.frame)] = now();
        gst_harness_push(background, frame(static_cast<GstClockTime>(step * event.frame)));
        continue;
      }
      const auto time = static_cast<GstClockTime>(step * event.mesh + feed.phase);
      came[static_cast<std::size_t>(event.mesh)] = now();
      for (GstHarness* harness : meshes) {
        GstBuffer* mesh = mesh_buffer(time);
        GST_BUFFER_DURATION(mesh) = feed.length;
        gst_harness_push(harness, mesh);
      }
    }
    g_usleep(200000);
  }

  /// How long the frames from \p first on lay about, ms: from when the frame and the mesh that
  /// \p offset frames later bears its number were there, without the time that drawing took. A busy
  /// machine may leave some frames out.
  std::vector<double> idle(int first, int offset = 0) {
    const std::scoped_lock lock(mutex);
    std::vector<double> out;
    for (int i = first; i < feed.frames - 1; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (!(left[at].time > 0.0)) continue;
      const double there = std::max(shown[at], came[static_cast<std::size_t>(i + offset)]);
      out.push_back(left[at].time - there - left[at].work);
    }
    fail_unless(
        !out.empty() &&
            (!in_time || 10 * static_cast<int>(out.size()) >= 8 * (feed.frames - 1 - first)),
        "only %d frames of %d have left", static_cast<int>(out.size()), feed.frames - 1 - first);
    std::sort(out.begin(), out.end());
    return out;
  }

  Feed feed;
  GstElement* element;
  GstBus* bus;
  GstHarness* background;
  std::vector<GstHarness*> meshes;
  std::mutex mutex;  // protects left
  std::vector<Left> left;
  std::vector<double> came, shown;  // when meshes and frames were pushed, ms
};

/// Frames leave within 5 ms (the middle one) of when all is there.
void expect_prompt(const Feed& feed, int offset = 0) {
  LiveBench bench(feed);
  bench.run();
  const std::vector<double> idle = bench.idle(8, offset);
  const double middle = idle[idle.size() / 2];
  fail_unless(!in_time || middle <= 5.0,
              "phase %g ms, length %g ms: idle for %.2f ms (%.2f to %.2f)",
              1e-6 * static_cast<double>(feed.phase), 1e-6 * static_cast<double>(feed.length),
              middle, idle.front(), idle.back());
}

}  // namespace

ELEMENT_TEST(a_frame_leaves_as_soon_as_its_mesh_is_there) {
  Feed feed;
  expect_prompt(feed);
  feed.phase = 3 * GST_MSECOND;  // less than what counts as the same instant
  expect_prompt(feed);
  feed.phase = -3 * static_cast<gint64>(GST_MSECOND);
  expect_prompt(feed);
  feed.phase = -20 * static_cast<gint64>(GST_MSECOND);
  expect_prompt(feed);
  // The mesh that is there when the frame begins; the next one begins too long after it.
  feed.phase = 15 * GST_MSECOND;
  expect_prompt(feed, -1);
}

ELEMENT_TEST(meshes_of_any_length_do) {
  Feed feed;
  feed.length = GST_CLOCK_TIME_NONE;
  expect_prompt(feed);
  feed.phase = -3 * static_cast<gint64>(GST_MSECOND);
  expect_prompt(feed);
  feed.length = 10 * GST_MSECOND;  // as long as the shutter is open
  expect_prompt(feed);
  feed.phase = 0;
  expect_prompt(feed);
  feed.interval = feed.length = 20 * GST_MSECOND;
  expect_prompt(feed);
  feed.pads = 3;
  expect_prompt(feed);
}

/// A mesh that does not come holds its own frame up until the deadline, and no other.
ELEMENT_TEST(a_mesh_that_does_not_come_costs_one_wait) {
  Feed feed;
  feed.missing = {20};
  LiveBench bench(feed);
  bench.run();
  std::vector<double> idle = bench.idle(8);
  fail_unless(!in_time || idle[idle.size() / 2] <= 5.0);
  const std::scoped_lock lock(bench.mutex);
  if (!in_time && !(bench.left[20].time > 0.0)) return;
  const double late = bench.left[20].time - bench.shown[20];
  // It is waited for as long as meshes have been late, and 6 ms; others may keep the machine busy.
  fail_unless(late >= 25.0 && (!in_time || late <= 250.0), "%.1f ms", late);
}

/// The latency that is reported: what is waited for and what drawing takes, the start apart.
ELEMENT_TEST(the_latency_holds_the_work) {
  LiveBench bench(Feed{});
  // In the room, with shadow and mirror image, drawing takes longer than latencies are rounded.
  g_object_set(bench.element, "scene", "builtin:room", "eye-x", 1.35, "eye-y", 1.5, "eye-z", 2.34,
               "edge-samples", 8, nullptr);
  gst_util_set_object_arg(G_OBJECT(bench.element), "shadow", "best");
  bench.run();
  const std::scoped_lock lock(bench.mutex);
  std::vector<double> works;
  for (const Left& frame : bench.left) works.push_back(frame.work);
  std::sort(works.begin(), works.end());
  const double work = works[works.size() / 2];
  const double latency = 1e-6 * static_cast<double>(gst_harness_query_latency(bench.background));
  fail_unless(latency >= 25.0 + work, "%.1f ms with %.1f ms of work", latency, work);
  const double wait = test::figure(bench.element, "wait-ms");
  fail_unless(latency >= wait + work, "%.1f ms with a wait of %.1f and %.1f ms of work", latency,
              wait, work);
  fail_unless(std::abs(latency - test::figure(bench.element, "latency-ms")) < 3.1);
  fail_unless(wait >= 25.0);
  GstMessage* message = gst_bus_pop_filtered(bench.bus, GST_MESSAGE_LATENCY);
  fail_unless(message != nullptr, "no message told it");
  gst_message_unref(message);
  // All that left came within it.
  int late = 0;
  for (std::size_t i = 8; i < bench.left.size(); ++i)
    late += bench.left[i].time > 40.0 * static_cast<double>(i) + latency + 5.0;
  fail_unless(!in_time || late <= static_cast<int>(bench.left.size() / 5),
              "%d frames left later than the %.1f ms said", late, latency);
}
