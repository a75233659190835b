// SPDX-License-Identifier: LGPL-2.1-or-later
// A long run of hullbuild: a moving figure seen by four cameras that lose views, fall out and come
// back, each on a thread of its own. Every mesh must be closed and have at least two views, and the
// memory must not grow. Usage: hullbuild_soak [FRAMES]
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "hull/measure.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

namespace {

using namespace polyhull;

constexpr int cameras = 4;
constexpr int recorded = 60;         // views of each camera, played back and forth
constexpr int frames_per_lap = 250;  // after that one camera falls out or comes back
constexpr GstClockTime frame_time = 40 * GST_MSECOND;

[[noreturn]] void fail(const std::string& what) {
  std::fprintf(stderr, "FAILED: %s\n", what.c_str());
  std::exit(1);
}

std::vector<std::vector<std::uint8_t>> record(int camera) {
  const std::string line = "rigtestsrc camera=cam" + std::to_string(camera) +
                           " num-buffers=" + std::to_string(recorded) +
                           " ! chromamatte ! gaussblur sigma=2 ! contourfind camera=cam" +
                           std::to_string(camera) + " tolerance=1 ! appsink name=out sync=false";
  GstElement* pipeline = gst_parse_launch(line.c_str(), nullptr);
  if (pipeline == nullptr) fail("the recording cannot be made: " + line);
  GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), "out");
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  std::vector<std::vector<std::uint8_t>> views;
  while (GstSample* sample = gst_app_sink_pull_sample(GST_APP_SINK(sink))) {
    GstBuffer* buffer = gst_sample_get_buffer(sample);
    std::vector<std::uint8_t>& bytes = views.emplace_back(gst_buffer_get_size(buffer));
    gst_buffer_extract(buffer, 0, bytes.data(), bytes.size());
    gst_sample_unref(sample);
  }
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(sink);
  gst_object_unref(pipeline);
  if (views.size() != recorded) fail("the recording is short");
  return views;
}

double resident_megabytes() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

// A camera's pad: linked to a pad of hullbuild while it is there.
struct Feed {
  std::vector<std::vector<std::uint8_t>> views;
  GstPad* source = nullptr;
  GstPad* sink = nullptr;

  void join(GstElement* hull) {
    source = gst_pad_new("feed", GST_PAD_SRC);
    gst_pad_set_active(source, TRUE);
    sink = gst_element_request_pad_simple(hull, "sink_%u");
    if (gst_pad_link(source, sink) != GST_PAD_LINK_OK) fail("a pad cannot be linked");
    gst_pad_push_event(source, gst_event_new_stream_start("feed"));
    GstCaps* caps = gst_caps_new_empty_simple("application/x-polyhull-view");
    gst_pad_push_event(source, gst_event_new_caps(caps));
    gst_caps_unref(caps);
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_pad_push_event(source, gst_event_new_segment(&segment));
  }
  void leave(GstElement* hull) {
    gst_pad_set_active(source, FALSE);
    gst_pad_unlink(source, sink);
    gst_element_release_request_pad(hull, sink);
    gst_object_unref(sink);
    gst_object_unref(source);
    source = sink = nullptr;
  }
  void push(int frame) {
    const int phase = frame % (2 * recorded);
    View view = read_view(Bytes(views[phase < recorded ? phase : 2 * recorded - 1 - phase]));
    view.trigger = frame;
    const std::vector<std::uint8_t> bytes = write_view(view);
    GstBuffer* buffer = gst_buffer_new_memdup(bytes.data(), bytes.size());
    GST_BUFFER_PTS(buffer) = frame * frame_time;
    if (gst_pad_push(source, buffer) != GST_FLOW_OK) fail("hullbuild refused a view");
  }
};

struct Judge {
  std::atomic<std::uint64_t> meshes{0}, triangles{0}, empty{0};
};

GstFlowReturn judge_mesh(GstPad*, GstObject* parent, GstBuffer* buffer) {
  auto& judge = *static_cast<Judge*>(g_object_get_data(G_OBJECT(parent), "judge"));
  GstMapInfo map;
  gst_buffer_map(buffer, &map, GST_MAP_READ);
  try {
    const Mesh mesh = read_mesh(Bytes(map.data, map.size));
    if (!is_closed(mesh.hull)) fail("mesh " + std::to_string(mesh.trigger) + " is not closed");
    if (mesh.views.size() < 2) fail("a mesh with fewer than two views");
    for (const MeshView& view : mesh.views)
      if (view.view.trigger != mesh.trigger) fail("views of two instants in one mesh");
    judge.triangles += mesh.hull.triangles.size() / 3;
    judge.empty += mesh.hull.empty();
  } catch (const Error& error) {
    fail(error.what());
  }
  gst_buffer_unmap(buffer, &map);
  gst_buffer_unref(buffer);
  ++judge.meshes;
  return GST_FLOW_OK;
}

// One lap: the cameras that are there send frames [first, last), each losing one in twenty.
void run_lap(std::vector<Feed>& feeds, int first, int last) {
  std::vector<std::thread> threads;
  for (int i = 0; i < cameras; ++i) {
    if (feeds[i].source == nullptr) continue;
    threads.emplace_back([&feed = feeds[i], first, last, i] {
      std::mt19937 random(static_cast<unsigned>(first * cameras + i));
      for (int frame = first; frame < last; ++frame)
        if (frame == last - 1 || random() % 20 != 0) feed.push(frame);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

int main(int count, char** arguments) {
  gst_init(nullptr, nullptr);
  const int frames = count > 1 ? std::atoi(arguments[1]) : 20000;
  GstElement* hull = gst_element_factory_make("hullbuild", nullptr);
  if (hull == nullptr) fail("there is no element hullbuild");
  g_object_set(hull, "missing-camera", 1, "sync-tolerance", guint64{5000000}, nullptr);
  Judge judge;
  GstPad* out = gst_pad_new("out", GST_PAD_SINK);
  // The pad's parent carries the judge.
  GstElement* holder = gst_bin_new("holder");
  g_object_set_data(G_OBJECT(holder), "judge", &judge);
  gst_element_add_pad(holder, out);
  gst_pad_set_chain_function(out, judge_mesh);
  gst_pad_set_active(out, TRUE);
  GstPad* source = gst_element_get_static_pad(hull, "src");
  gst_pad_link_full(source, out, GST_PAD_LINK_CHECK_NOTHING);
  gst_object_unref(source);
  gst_element_set_state(hull, GST_STATE_PLAYING);

  std::vector<Feed> feeds(cameras);
  for (int i = 0; i < cameras; ++i) {
    feeds[i].views = record(i);
    feeds[i].join(hull);
  }
  std::mt19937 random(1);
  double settled = 0.0;
  for (int first = 0; first < frames; first += frames_per_lap) {
    run_lap(feeds, first, std::min(first + frames_per_lap, frames));
    Feed& feed = feeds[random() % cameras];
    int present = 0;
    for (const Feed& other : feeds) present += other.source != nullptr;
    if (feed.source == nullptr)
      feed.join(hull);
    else if (present > 2)
      feed.leave(hull);
    if (settled == 0.0 && first >= frames / 4) settled = resident_megabytes();
  }
  const double grown = resident_megabytes() - settled;
  for (Feed& feed : feeds)
    if (feed.source != nullptr) feed.leave(hull);
  gst_element_set_state(hull, GST_STATE_NULL);
  GstStructure* stats = nullptr;
  g_object_get(hull, "stats", &stats, nullptr);
  g_autofree gchar* text = gst_structure_to_string(stats);
  gst_structure_free(stats);
  gst_object_unref(hull);
  gst_object_unref(holder);
  std::printf(
      "%d frames, %llu meshes, all closed, %llu empty, %.0f triangles each; memory %.1f MB, "
      "grown by %.1f MB since the first quarter\n%s\n",
      frames, static_cast<unsigned long long>(judge.meshes),
      static_cast<unsigned long long>(judge.empty),
      static_cast<double>(judge.triangles) / std::max<double>(1.0, judge.meshes), settled + grown,
      grown, text);
  if (judge.meshes < static_cast<std::uint64_t>(frames) * 9 / 10) fail("too few meshes");
  if (grown > 8.0) fail("the memory grows");
  return 0;
}
