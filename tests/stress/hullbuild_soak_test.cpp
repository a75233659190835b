// SPDX-License-Identifier: LGPL-2.1-or-later
// hullbuild over many frames of a moving figure with cameras that fall silent, come back, leave and
// join: every mesh is sound and memory stays. POLYHULL_STRESS multiplies the 200 frames: 100 gives
// 20,000.
#include <gst/gst.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>

#include "base/error.h"
#include "support/mesh_checks.h"
#include "support/run_kind.h"
#include "support/scenes.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

namespace polyhull::test {
namespace {

constexpr int cameras = 5;
constexpr GstClockTime frame_time = 40 * GST_MSECOND;

std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * 4096;
}

/// What arrives behind hullbuild.
struct Arrivals {
  std::atomic<int> meshes{0}, empty{0}, unsound{0};
  std::atomic<std::size_t> triangles{0};
};

void on_mesh(GstElement*, GstBuffer* buffer, GstPad*, gpointer data) {
  auto& arrivals = *static_cast<Arrivals*>(data);
  GstMapInfo map;
  if (!gst_buffer_map(buffer, &map, GST_MAP_READ)) {
    ++arrivals.unsound;
    return;
  }
  try {
    const Mesh mesh = read_mesh(Bytes(map.data, map.size));
    ++arrivals.meshes;
    arrivals.empty += mesh.hull.empty();
    const MeshReport report = check_mesh(mesh.hull);
    if (!report.sound()) {
      ++arrivals.unsound;
      std::printf("mesh %d: %s\n", arrivals.meshes.load(), report.describe().c_str());
    }
    arrivals.triangles = std::max(arrivals.triangles.load(), report.triangles);
  } catch (const Error& error) {
    ++arrivals.unsound;
    std::printf("mesh refused: %s\n", error.what());
  }
  gst_buffer_unmap(buffer, &map);
}

/// Keeps of the messages, which nobody reads before the end, only what ends the stream.
GstBusSyncReply on_message(GstBus*, GstMessage* message, gpointer) {
  const bool ends = GST_MESSAGE_TYPE(message) == GST_MESSAGE_EOS ||
                    GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR;
  if (!ends) gst_message_unref(message);
  return ends ? GST_BUS_PASS : GST_BUS_DROP;
}

/// One camera: a source pad of the test's own and a short queue, linked to a request pad.
class Source {
 public:
  Source(GstElement* pipeline, GstElement* hullbuild, const std::string& camera)
      : pipeline_(pipeline), hullbuild_(hullbuild), camera_(camera) {
    join();
  }
  ~Source() { leave(); }
  bool linked() const { return pad_ != nullptr; }

  void join() {
    queue_ = gst_element_factory_make("queue", nullptr);
    g_object_set(queue_, "max-size-buffers", 4, "max-size-time", guint64{0}, "max-size-bytes", 0,
                 nullptr);
    gst_bin_add(GST_BIN(pipeline_), queue_);
    sink_ = gst_element_request_pad_simple(hullbuild_, "sink_%u");
    g_autoptr(GstPad) queue_source = gst_element_get_static_pad(queue_, "src");
    ASSERT_EQ(gst_pad_link(queue_source, sink_), GST_PAD_LINK_OK);
    gst_element_sync_state_with_parent(queue_);
    pad_ = gst_pad_new("src", GST_PAD_SRC);
    gst_pad_set_active(pad_, TRUE);
    g_autoptr(GstPad) queue_sink = gst_element_get_static_pad(queue_, "sink");
    ASSERT_EQ(gst_pad_link(pad_, queue_sink), GST_PAD_LINK_OK);
    gst_pad_push_event(pad_, gst_event_new_stream_start(camera_.c_str()));
    g_autoptr(GstCaps) caps = gst_caps_new_empty_simple("application/x-polyhull-view");
    gst_pad_push_event(pad_, gst_event_new_caps(caps));
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_pad_push_event(pad_, gst_event_new_segment(&segment));
  }

  void leave() {
    if (pad_ == nullptr) return;
    gst_element_release_request_pad(hullbuild_, sink_);
    gst_object_unref(sink_);
    gst_element_set_state(queue_, GST_STATE_NULL);
    gst_bin_remove(GST_BIN(pipeline_), queue_);
    gst_pad_set_active(pad_, FALSE);
    gst_object_unref(pad_);
    pad_ = nullptr;
  }

  GstFlowReturn push(GstBuffer* buffer) { return gst_pad_push(pad_, buffer); }
  void end() { gst_pad_push_event(pad_, gst_event_new_eos()); }

 private:
  GstElement *pipeline_, *hullbuild_, *queue_ = nullptr;
  std::string camera_;
  GstPad *pad_ = nullptr, *sink_ = nullptr;
};

GstBuffer* view_buffer(const HullScene& scene, std::size_t camera, int frame) {
  View view;
  view.camera = scene.rig.cameras[camera].name;
  view.trigger = static_cast<std::uint64_t>(frame);
  view.width = scene.rig.cameras[camera].width;
  view.height = scene.rig.cameras[camera].height;
  view.contours = scene.silhouettes[camera];
  const std::vector<std::uint8_t> bytes = write_view(view);
  return gst_buffer_new_memdup(bytes.data(), bytes.size());
}

TEST(HullbuildSoak, AMovingFigureWithCamerasThatComeAndGo) {
  gst_init(nullptr, nullptr);
  const char* factor = std::getenv("POLYHULL_STRESS");
  const int frames = 200 * (factor ? std::max(1, std::atoi(factor)) : 1);
  std::vector<HullScene> walk;
  for (int i = 0; i < 30; ++i) walk.push_back(figure_scene(cameras, 24, 0.1 * i));
  const std::string rig =
      (std::filesystem::temp_directory_path() / "polyhull_soak_rig.json").string();
  std::ofstream(rig) << rig_to_json(walk[0].rig);

  GstElement* pipeline = gst_pipeline_new(nullptr);
  GstElement* hullbuild = gst_element_factory_make("hullbuild", nullptr);
  GstElement* sink = gst_element_factory_make("fakesink", nullptr);
  ASSERT_NE(hullbuild, nullptr) << "the plugin is not found: GST_PLUGIN_PATH";
  gst_util_set_object_arg(G_OBJECT(hullbuild), "rig", rig.c_str());
  gst_util_set_object_arg(G_OBJECT(hullbuild), "missing-camera", "drop-camera");
  gst_util_set_object_arg(G_OBJECT(hullbuild), "min-cameras", "2");
  g_object_set(sink, "sync", FALSE, "signal-handoffs", TRUE, nullptr);
  Arrivals arrivals;
  g_signal_connect(sink, "handoff", G_CALLBACK(on_mesh), &arrivals);
  gst_bin_add_many(GST_BIN(pipeline), hullbuild, sink, nullptr);
  ASSERT_TRUE(gst_element_link(hullbuild, sink));
  g_autoptr(GstBus) bus = gst_element_get_bus(pipeline);
  gst_bus_set_sync_handler(bus, on_message, nullptr, nullptr);
  ASSERT_NE(gst_element_set_state(pipeline, GST_STATE_PLAYING), GST_STATE_CHANGE_FAILURE);

  std::size_t after_a_quarter = 0;
  int possible = 0;  // meshes: frames of which at least two cameras send a view
  {
    std::vector<std::unique_ptr<Source>> sources;
    for (const Camera& camera : walk[0].rig.cameras) {
      sources.push_back(std::make_unique<Source>(pipeline, hullbuild, camera.name));
    }
    Dice dice(5);
    std::vector<bool> silent(cameras, false);
    for (int frame = 0; frame < frames; ++frame) {
      const HullScene& scene = walk[static_cast<std::size_t>(std::abs(frame % 58 - 29))];
      if (dice.chance(0.05)) {
        const auto which = static_cast<std::size_t>(dice.whole(0, cameras - 1));
        silent[which] = !silent[which];
      }
      std::size_t joined = 0;
      if (dice.chance(0.02)) {
        joined = static_cast<std::size_t>(dice.whole(1, cameras - 1));
        Source& source = *sources[joined];
        if (source.linked()) {
          source.leave();
        } else {
          source.join();
        }
      }
      // A pad that has just joined goes first: hullbuild waits for it before it takes from the
      // others.
      std::vector<std::size_t> order;
      for (std::size_t i = 0; i < sources.size(); ++i)
        order.push_back((joined + i) % sources.size());
      int views = 0;
      for (const std::size_t i : order) {
        if (!sources[i]->linked()) continue;
        views += !silent[i];
        GstBuffer* buffer = nullptr;
        if (silent[i]) {
          buffer = gst_buffer_new();  // a gap, as the aggregator makes of a GAP event
          GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_GAP);
        } else {
          buffer = view_buffer(scene, i, frame);
        }
        GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(frame) * frame_time;
        GST_BUFFER_DURATION(buffer) = frame_time;
        ASSERT_EQ(sources[i]->push(buffer), GST_FLOW_OK) << "frame " << frame << ", camera " << i;
      }
      possible += views >= 2;
      if (frame == frames / 4) after_a_quarter = resident_bytes();
    }
    for (const auto& source : sources) {
      if (source->linked()) source->end();
    }
    g_autoptr(GstMessage) message = gst_bus_timed_pop_filtered(
        bus, 60 * GST_SECOND, static_cast<GstMessageType>(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    ASSERT_NE(message, nullptr) << "no end of stream";
    EXPECT_EQ(GST_MESSAGE_TYPE(message), GST_MESSAGE_EOS);
    gst_element_set_state(pipeline, GST_STATE_NULL);
  }
  const std::size_t end = resident_bytes();
  std::printf(
      "%d frames, %d meshes of %d, %d empty, up to %zu triangles; %.1f MB after a quarter, %.1f MB "
      "at "
      "the end\n",
      frames, arrivals.meshes.load(), possible, arrivals.empty.load(), arrivals.triangles.load(),
      double(after_a_quarter) / 1e6, double(end) / 1e6);
  gst_object_unref(pipeline);
  // Those that leave take along what they have sent last.
  EXPECT_GT(arrivals.meshes, possible - possible / 5);
  EXPECT_EQ(arrivals.unsound, 0);
  // The sanitizers hold freed memory back; there the leak check judges.
  if (!sanitized()) {
    EXPECT_LT(end, after_a_quarter + after_a_quarter / 20 + 4000000);
  }
}

}  // namespace
}  // namespace polyhull::test
