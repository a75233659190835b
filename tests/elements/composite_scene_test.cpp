// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes that a background announces and composite cannot read, or not yet.
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "composite_bench.h"
#include "scene/announcement.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// A folder of this process, gone with it.
struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               ("polyhull_composite_scene_" + std::to_string(getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
  std::string scene(const std::string& name) const { return (path / name).string(); }
};

/// Frames with a subject, each announced.
struct Announced : Bench {
  int number = 0;
  Announced() {
    wait_for_all();
    gst_util_set_object_arg(G_OBJECT(element), "backend", "processor");
    gst_harness_push(mesh, mesh_buffer(0));
  }
  guint64 count(const char* name) const { return test::statistic(element, name); }
  void show(const std::string& scene) {
    Announcement announcement;
    announcement.viewport = synthetic::look_at({0, 1.2, 4.0}, {0, 1, 0}, width, height, 50.0);
    announcement.scene = scene;
    announcement.lights = synthetic::small_room(true).lights;
    gst_harness_push_event(
        background, gst_event_new_custom(
                        GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                        gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING,
                                          announcement_to_json(announcement).c_str(), nullptr)));
    ++number;
    gst_buffer_unref(step(frame(frame_time(number - 1)), mesh_buffer(frame_time(number))));
  }
};

}  // namespace

// While a file is announced that cannot be read, the scene before it stays as it is, read once.
GST_START_TEST(the_last_scene_stays) {
  const Folder folder;
  save_scene(synthetic::small_room(true), folder.scene("good.glb"));
  Announced bench;
  for (int i = 0; i < 2; ++i) bench.show(folder.scene("good.glb"));
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 1);
  // Even its file may go.
  std::filesystem::remove(folder.scene("good.glb"));
  for (int i = 0; i < 3; ++i) bench.show(folder.scene("missing.glb"));
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 3);
  fail_unless_equals_uint64(bench.count("drawn"), 5);
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 4);
  bench.show(folder.scene("good.glb"));
  fail_unless_equals_uint64(bench.count("announcements"), 3);
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 5);
}
GST_END_TEST;

// A file that could not be read is read again when it has changed, not before.
GST_START_TEST(a_file_that_changes_is_tried_again) {
  const Folder folder;
  const std::string name = folder.scene("late.glb");
  Announced bench;
  bench.show(name);
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 1);
  std::ofstream(name) << "half of it";
  bench.show(name);
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 2);
  const auto written = std::filesystem::last_write_time(name);
  save_scene(synthetic::small_room(true), name);
  std::filesystem::last_write_time(name, written);
  bench.show(name);
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 3);
  std::filesystem::last_write_time(name, written + std::chrono::seconds(2));
  bench.show(name);
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 3);
  fail_unless_equals_uint64(bench.count("announcements"), 1);
}
GST_END_TEST;

static Suite* composite_scene_suite(void) {
  Suite* suite = suite_create("composite_scene");
  TCase* tcase = tcase_create("general");
  tcase_set_timeout(tcase, 120);
  tcase_add_test(tcase, the_last_scene_stays);
  tcase_add_test(tcase, a_file_that_changes_is_tried_again);
  suite_add_tcase(suite, tcase);
  return suite;
}

GST_CHECK_MAIN(composite_scene);
