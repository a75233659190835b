// SPDX-License-Identifier: LGPL-2.1-or-later
// What scenesrc's drawing has ready, on its way to composite.
#include "composite_bench.h"

#include <string>
#include <vector>

#include "element_test.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

GstBuffer* without_metas(GstBuffer* buffer) {
  GstBuffer* copy = gst_buffer_new();
  gst_buffer_copy_into(
      copy, buffer,
      static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_TIMESTAMPS | GST_BUFFER_COPY_MEMORY), 0, -1);
  return copy;
}

/// What scenesrc sends while its viewport travels, each frame with the announcement that is its.
struct Travelling {
  std::vector<GstBuffer*> frames;
  std::vector<GstEvent*> announcements;
  Travelling() {
    // The harness starts a source at once: the size must be asked for by then.
    const std::string line =
        "scenesrc path=orbit num-buffers=4 light-spacing=.2 light-cache=false ! capsfilter caps=";
    GstHarness* harness = gst_harness_new_parse((line + background_caps).c_str());
    gst_harness_play(harness);
    for (int i = 0; i < 4; ++i) frames.push_back(gst_harness_pull(harness));
    while (GstEvent* event = gst_harness_try_pull_event(harness)) {
      if (gst_event_has_name(event, "polyhull-announcement"))
        announcements.push_back(event);
      else
        gst_event_unref(event);
    }
    gst_harness_teardown(harness);
    fail_unless_equals_int(static_cast<int>(announcements.size()), 4);
  }
  ~Travelling() {
    for (GstBuffer* frame : frames) gst_buffer_unref(frame);
    for (GstEvent* event : announcements) gst_event_unref(event);
  }

  /// The composites of the frames, as they are or without what is attached to them, announced by
  /// those \p later; \p taken: how often planes were.
  std::vector<std::vector<guint8>> composites(bool as_they_are, std::size_t later,
                                              guint64& taken) const {
    Bench bench;
    bench.wait_for_all();
    gst_util_set_object_arg(G_OBJECT(bench.element), "backend", "processor");
    gst_harness_push(bench.mesh, mesh_buffer(0));
    std::vector<std::vector<guint8>> out;
    for (std::size_t i = 0; i + later < frames.size(); ++i) {
      gst_harness_push_event(bench.background, gst_event_ref(announcements[i + later]));
      GstBuffer* picture =
          bench.step(as_they_are ? gst_buffer_copy(frames[i]) : without_metas(frames[i]),
                     mesh_buffer((i + 1) * 40 * GST_MSECOND));
      GstMapInfo map;
      fail_unless(gst_buffer_map(picture, &map, GST_MAP_READ));
      out.emplace_back(map.data, map.data + map.size);
      gst_buffer_unmap(picture, &map);
      gst_buffer_unref(picture);
    }
    taken = statistic(bench.element, "scene-planes-taken");
    fail_unless_equals_uint64(statistic(bench.element, "drawn"), out.size());
    return out;
  }
};

}  // namespace

/// What scenesrc's drawing has ready saves composite work, and changes no bit.
ELEMENT_TEST(takes_planes_of_its_own_view) {
  const Travelling travelling;
  guint64 taken = 0;
  const auto expected = travelling.composites(false, 0, taken);
  fail_unless_equals_uint64(taken, 0);
  fail_unless(travelling.composites(true, 0, taken) == expected);
  fail_unless_equals_uint64(taken, 4);
  // Announced as the next frame's view: those of this frame are of another.
  const auto shifted = travelling.composites(false, 1, taken);
  fail_unless(travelling.composites(true, 1, taken) == shifted);
  fail_unless_equals_uint64(taken, 0);
}

namespace {

constexpr char subject_of_three[] =
    " hullbuild name=hull ! hulltexture ! mix.mesh_0 "
    "rigtestsrc camera=cam0 num-buffers=3 ! silhouette camera=cam0 ! hull. "
    "rigtestsrc camera=cam1 num-buffers=3 ! silhouette camera=cam1 ! hull. "
    "rigtestsrc camera=cam2 num-buffers=3 ! silhouette camera=cam2 ! hull.";

}  // namespace

/// Through elements that pass metas on; a new size is another view.
ELEMENT_TEST(planes_go_through_other_elements) {
  const struct {
    const char* way;
    bool same_view;
  } ways[] = {{"video/x-raw,format=RGBA,width=320,height=180 ! queue", true},
              {"video/x-raw,format=BGRA,width=320,height=180 ! videoconvert ! capsfilter "
               "caps=video/x-raw,format=RGBA",
               true},
              {"video/x-raw,format=BGRx,width=320,height=180 ! queue", true},
              {"video/x-raw,format=RGBA,width=640,height=360 ! videoscale", false}};
  for (const auto& [way, same_view] : ways) {
    GstElement* pipeline = parse(
        "composite name=mix backend=processor ! fakesink "
        "scenesrc path=orbit num-buffers=3 light-spacing=.2 light-cache=false ! " +
        std::string(way) + " ! video/x-raw,width=320,height=180 ! mix.background " +
        subject_of_three);
    GstElement* mix = named(pipeline, "mix");
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    check_ended(wait_for_end(pipeline));
    const guint64 drawn = statistic(mix, "drawn");
    fail_unless(drawn >= 2, "%s", way);
    fail_unless_equals_uint64(statistic(mix, "scene-planes-taken"), same_view ? drawn : 0);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}
