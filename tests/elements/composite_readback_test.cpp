// SPDX-License-Identifier: LGPL-2.1-or-later
// async-readback of composite: the same pictures in the same order, one frame later.
#include <mutex>
#include <string>
#include <vector>

#include "composite_bench.h"
#include "element_test.h"
#include "gl_errors.h"

using namespace polyhull;
using namespace polyhull::test;
using polyhull::testing::SayGlError;

namespace {

/// A frame that came out: when it is shown, its bytes, and the width that its caps said.
struct Shown {
  GstClockTime time;
  std::vector<std::uint8_t> bytes;
  int width;
  bool operator==(const Shown&) const = default;
};

/// A Bench whose outputs are kept as they come.
struct ReadbackBench : Bench {
  explicit ReadbackBench(bool later, const char* backend = "gl") {
    wait_for_all();
    gst_util_set_object_arg(G_OBJECT(element), "backend", backend);
    g_object_set(element, "async-readback", later, nullptr);
    gst_pad_add_probe(background->sinkpad, GST_PAD_PROBE_TYPE_BUFFER, keep, this, nullptr);
    gst_harness_set_drop_buffers(background, TRUE);
    gst_harness_push(mesh, mesh_buffer(0));
  }
  static GstPadProbeReturn keep(GstPad* pad, GstPadProbeInfo* info, gpointer data) {
    auto& self = *static_cast<ReadbackBench*>(data);
    GstBuffer* buffer = GST_PAD_PROBE_INFO_BUFFER(info);
    GstCaps* caps = gst_pad_get_current_caps(pad);
    int caps_width = 0;
    gst_structure_get_int(gst_caps_get_structure(caps, 0), "width", &caps_width);
    gst_caps_unref(caps);
    GstMapInfo map;
    fail_unless(gst_buffer_map(buffer, &map, GST_MAP_READ));
    const std::scoped_lock lock(self.mutex);
    self.kept.push_back({GST_BUFFER_PTS(buffer), {map.data, map.data + map.size}, caps_width});
    gst_buffer_unmap(buffer, &map);
    return GST_PAD_PROBE_OK;
  }
  /// Pushes frame \p i and the mesh after its own, and waits until composite is done with it.
  void feed(int i) {
    const guint64 before = statistic(element, "frames");
    gst_harness_push(background, frame(frame_time(i)));
    gst_harness_push(mesh, mesh_buffer(frame_time(i + 1)));
    for (int k = 0; k < 6000 && statistic(element, "frames") == before; ++k) g_usleep(5000);
    fail_unless_equals_uint64(statistic(element, "frames"), before + 1);
  }
  /// Whether \p count frames come out, and no more; they come a moment after they are counted.
  bool has(std::size_t count) {
    for (int k = 0; k < 2000 && shown().size() < count; ++k) g_usleep(5000);
    g_usleep(50000);
    return shown().size() == count;
  }
  std::vector<Shown> shown() {
    const std::scoped_lock lock(mutex);
    return kept;
  }
  void end() {
    gst_harness_push_event(mesh, gst_event_new_eos());
    gst_harness_push_event(background, gst_event_new_eos());
  }
  std::mutex mutex;  // protects kept
  std::vector<Shown> kept;
};

/// Five frames, each with the subject elsewhere, in the third out of the picture.
std::vector<Shown> run(bool later, const char* backend = "gl") {
  ReadbackBench bench(later, backend);
  const double places[] = {0.0, 0.2, 500.0, -0.3, 0.1};
  const bool holds = later && std::string(backend) == "gl";
  const std::size_t out[] = {0, 1, 3, 3, 4};  // after each: the third needs no drawing
  for (int i = 0; i < 5; ++i) {
    gst_child_proxy_set(GST_CHILD_PROXY(bench.element), "mesh_0::translate-x", places[i], nullptr);
    bench.feed(i);
    fail_unless(bench.has(holds ? out[i] : static_cast<std::size_t>(i) + 1), "frame %d", i);
  }
  bench.end();
  fail_unless(bench.has(5));
  return bench.shown();
}

}  // namespace

ELEMENT_TEST(the_same_pictures_come_one_frame_later) {
  const std::vector<Shown> wanted = run(false), late = run(true);
  fail_unless(wanted[0].bytes != wanted[1].bytes);
  for (std::size_t i = 0; i < 5; ++i) {
    fail_unless_equals_uint64(late[i].time, frame_time(static_cast<int>(i)));
    fail_unless(late[i] == wanted[i], "frame %d", static_cast<int>(i));
  }
  fail_unless(run(true, "processor") == run(false, "processor"));
}

ELEMENT_TEST(what_is_held_goes_before_new_caps) {
  ReadbackBench bench(true);
  bench.feed(0);
  fail_unless(bench.has(0));
  gst_harness_set_src_caps_str(bench.background,
                               "video/x-raw,format=RGBA,width=160,height=180,framerate=25/1");
  GstBuffer* half = gst_buffer_new_allocate(nullptr, 4 * 160 * height, nullptr);
  gst_buffer_memset(half, 0, grey, 4 * 160 * height);
  GST_BUFFER_PTS(half) = frame_time(1);
  GST_BUFFER_DURATION(half) = 40 * GST_MSECOND;
  gst_harness_push(bench.background, half);
  gst_harness_push(bench.mesh, mesh_buffer(frame_time(2)));
  bench.end();
  fail_unless(bench.has(2));
  const std::vector<Shown> shown = bench.shown();
  for (int i = 0; i < 2; ++i) {
    const Shown& s = shown[static_cast<std::size_t>(i)];
    fail_unless_equals_uint64(s.time, frame_time(i));
    fail_unless_equals_int(s.width, i == 0 ? width : 160);
    fail_unless_equals_int(static_cast<int>(s.bytes.size()), 4 * s.width * height);
  }
}

ELEMENT_TEST(a_flush_drops_what_is_held) {
  ReadbackBench bench(true);
  bench.feed(0);
  for (GstHarness* input : {bench.background, bench.mesh})
    gst_harness_push_event(input, gst_event_new_flush_start());
  for (GstHarness* input : {bench.background, bench.mesh}) {
    gst_harness_push_event(input, gst_event_new_flush_stop(TRUE));
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_harness_push_event(input, gst_event_new_segment(&segment));
  }
  gst_harness_push(bench.mesh, mesh_buffer(frame_time(5)));
  bench.feed(5);
  bench.end();
  fail_unless(bench.has(1));
  fail_unless_equals_uint64(bench.shown()[0].time, frame_time(5));
}

// Of what OpenGL had under way nothing is left; what follows is drawn by the processor.
ELEMENT_TEST(what_opengl_loses_is_left_out) {
  ReadbackBench bench(true);
  bench.feed(0);
  {
    const SayGlError said(GL_OUT_OF_MEMORY, 1);
    bench.feed(1);
    fail_unless(bench.has(1));
  }
  fail_unless_equals_uint64(bench.shown()[0].time, frame_time(1));
  fail_unless_equals_uint64(statistic(bench.element, "frames-lost"), 1);
  fail_unless_equals_uint64(statistic(bench.element, "drawn-by-processor"), 1);
  fail_unless_equals_uint64(statistic(bench.element, "gl-failures"), 1);
}

namespace {

/// The latency of a live line at 5 frames a second, at its end; ms.
double latency_of_later_pictures() {
  GstElement* pipeline = parse(
      "composite name=mix backend=gl async-readback=true ! video/x-raw ! fakesink sync=true "
      " videotestsrc is-live=true num-buffers=8 ! "
      "video/x-raw,format=RGBA,width=160,height=90,framerate=5/1 ! mix.background "
      "hullbuild name=hull ! mix.mesh_0 "
      "rigtestsrc is-live=true camera=cam0 num-buffers=8 ! video/x-raw,framerate=5/1 ! "
      "silhouette camera=cam0 ! hull. "
      "rigtestsrc is-live=true camera=cam1 num-buffers=8 ! video/x-raw,framerate=5/1 ! "
      "silhouette camera=cam1 ! hull. ");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  check_ended(wait_for_end(pipeline));
  GstElement* mix = named(pipeline, "mix");
  GstQuery* query = gst_query_new_latency();
  GstPad* pad = gst_element_get_static_pad(mix, "src");
  fail_unless(gst_pad_query(pad, query));
  GstClockTime least = 0;
  gst_query_parse_latency(query, nullptr, &least, nullptr);
  gst_query_unref(query);
  gst_object_unref(pad);
  stop(pipeline);
  return 1e-6 * static_cast<double>(least);
}

}  // namespace

// A frame's time in the sources, one more until its picture comes, and the drawing, which a busy
// machine makes as long as it likes.
ELEMENT_TEST(the_latency_has_the_frame_in_it) {
  const double later = latency_of_later_pictures();
  fail_unless(later >= 400.0, "%.1f ms", later);
}

// Live, a background that pauses keeps nothing back.
ELEMENT_TEST(a_live_pause_lets_it_go) {
  GstElement* element =
      gst_element_factory_make_full("composite", "force-live", TRUE, "async-readback", TRUE,
                                    "eye-y", 1.2, "eye-z", 4.0, "target-y", 1.0, nullptr);
  gst_object_ref_sink(element);
  gst_util_set_object_arg(G_OBJECT(element), "backend", "gl");
  GstHarness* background = gst_harness_new_with_element(element, "background", "src");
  GstHarness* mesh = gst_harness_new_with_element(element, "mesh_%u", nullptr);
  gst_harness_set_src_caps_str(mesh, mesh_caps);
  gst_harness_use_systemclock(background);
  gst_harness_set_src_caps_str(background, background_caps);
  GstClock* clock = gst_element_get_clock(element);
  gst_element_set_base_time(element, gst_clock_get_time(clock));
  gst_object_unref(clock);
  gst_harness_play(background);
  gst_harness_push(mesh, mesh_buffer(0));
  gst_harness_push(background, frame(0));
  GstBuffer* out = gst_harness_pull(background);
  fail_unless(out != nullptr, "it is still held");
  fail_unless(changed_pixels(out) > 500);
  gst_buffer_unref(out);
  gst_harness_teardown(mesh);
  gst_harness_teardown(background);
  gst_object_unref(element);
}
