// SPDX-License-Identifier: LGPL-2.1-or-later
// Of a scene that holds no light.
#include <gst/video/video.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "builtin/shapes.h"
#include "element_checks.h"
#include "scene/announcement.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

std::filesystem::path folder;

/// A floor and a box, and no lamp.
std::string dark_scene() {
  const std::string path = (folder / "dark.glb").string();
  Scene scene;
  scene.materials.resize(1);
  scene.meshes = {parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                  box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f})};
  save_scene(scene, path);
  return path;
}

/// The frames that a playing scenesrc makes.
struct Watched {
  GstElement* pipeline;
  std::vector<double> means;
  std::string announcement;
  GMutex mutex;
  GCond cond;

  explicit Watched(const std::string& properties) {
    g_mutex_init(&mutex);
    g_cond_init(&cond);
    pipeline = parse("scenesrc name=src light-cache=false light-spacing=0.1 scene=" + dark_scene() +
                     " " + properties +
                     " ! video/x-raw,format=RGBA,width=32,height=24,framerate=50/1 ! "
                     "fakesink name=sink sync=true");
    GstElement* sink = gst_bin_get_by_name(GST_BIN(pipeline), "sink");
    GstPad* pad = gst_element_get_static_pad(sink, "sink");
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, take, this, nullptr);
    gst_object_unref(pad);
    gst_object_unref(sink);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
  }
  ~Watched() {
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
    g_mutex_clear(&mutex);
    g_cond_clear(&cond);
  }
  static GstPadProbeReturn take(GstPad* pad, GstPadProbeInfo* probe, gpointer data) {
    Watched& self = *static_cast<Watched*>(data);
    GstMapInfo map;
    fail_unless(gst_buffer_map(GST_PAD_PROBE_INFO_BUFFER(probe), &map, GST_MAP_READ));
    double sum = 0.0;
    // The lower half: floor.
    for (std::size_t i = map.size / 2; i < map.size; i += 4) sum += map.data[i];
    g_mutex_lock(&self.mutex);
    self.means.push_back(8.0 * sum / static_cast<double>(map.size));
    GstEvent* event = gst_pad_get_sticky_event(pad, GST_EVENT_CUSTOM_DOWNSTREAM_STICKY, 0);
    if (event != nullptr) {
      self.announcement = gst_structure_get_string(gst_event_get_structure(event), "json");
      gst_event_unref(event);
    }
    g_cond_broadcast(&self.cond);
    g_mutex_unlock(&self.mutex);
    gst_buffer_unmap(GST_PAD_PROBE_INFO_BUFFER(probe), &map);
    return GST_PAD_PROBE_OK;
  }
  /// Waits until a frame's mean is from \p low to \p high.
  void expect_mean(double low, double high) {
    const gint64 end = g_get_monotonic_time() + 30 * G_TIME_SPAN_SECOND;
    g_mutex_lock(&mutex);
    while (means.empty() || means.back() < low || means.back() > high)
      fail_unless(g_cond_wait_until(&cond, &mutex, end), "no frame of mean %g to %g came; last %g",
                  low, high, means.empty() ? -1.0 : means.back());
    g_mutex_unlock(&mutex);
  }
  void set(const char* name, const char* value) {
    GstElement* source = gst_bin_get_by_name(GST_BIN(pipeline), "src");
    gst_util_set_object_arg(G_OBJECT(source), name, value);
    gst_object_unref(source);
  }
  void expect_warning(const char* text) {
    GstBus* bus = gst_element_get_bus(pipeline);
    test::expect_warning(bus, text);
    gst_object_unref(bus);
  }
  Announcement announced() {
    g_mutex_lock(&mutex);
    const Announcement announcement = parse_announcement(announcement_text());
    g_mutex_unlock(&mutex);
    return announcement;
  }
  const std::string& announcement_text() const { return announcement; }
};

}  // namespace

GST_START_TEST(a_scene_without_light_is_lit_by_a_sky) {
  for (const char* live : {"is-live=false", "is-live=true", "is-live=true progressive=false"}) {
    Watched watched(live);
    watched.expect_warning("holds no light: an even sky and a sun");
    watched.expect_mean(150, 230);
    const Announcement told = watched.announced();
    fail_unless_equals_int(told.lights.size(), 1);
    fail_unless(told.sky.x > 0.0f);
    fail_unless(told.ambient.x > 0.5f, "the sky counts as ambient light");
    // Live: the light is made brighter and taken away without being computed anew.
    watched.set("light-intensity", "0.25");
    watched.expect_mean(60, 140);
    // Subjects are lit relative to what has been dimmed.
    const Announcement dimmed = watched.announced();
    fail_unless(told.undimmed.empty() && !told.undimmed_sky);
    fail_unless(dimmed.undimmed == told.lights && dimmed.undimmed_sky == told.sky);
    fail_unless(dimmed.lights[0].radiance == 0.25f * told.lights[0].radiance);
    watched.set("light-intensity", "1");
    watched.expect_mean(150, 230);
    watched.set("assumed-light", "false");
    watched.expect_mean(0, 0);
    fail_unless(watched.announced().sky == Vec3f(0.0f));
    watched.set("assumed-light", "true");
    watched.expect_mean(150, 230);
  }
}
GST_END_TEST;

GST_START_TEST(or_dark_where_that_is_asked_for) {
  for (const char* live : {"is-live=false", "is-live=true"}) {
    Watched watched(std::string("assumed-light=false ") + live);
    watched.expect_warning("holds no light, and none is assumed");
    watched.expect_mean(0, 0);
    watched.set("assumed-light", "true");
    watched.expect_mean(150, 230);
  }
}
GST_END_TEST;

static Suite* scenesrc_light_suite() {
  Suite* suite = suite_create("scenesrc_light");
  TCase* tests = tcase_create("general");
  tcase_set_timeout(tests, 120);
  suite_add_tcase(suite, tests);
  folder = std::filesystem::temp_directory_path() /
           ("polyhull_scenesrc_light_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  tcase_add_test(tests, a_scene_without_light_is_lit_by_a_sky);
  tcase_add_test(tests, or_dark_where_that_is_asked_for);
  return suite;
}

int main(int argc, char** argv) {
  gst_check_init(&argc, &argv);
  const int failures = gst_check_run_suite(scenesrc_light_suite(), "scenesrc_light", __FILE__);
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return failures;
}
