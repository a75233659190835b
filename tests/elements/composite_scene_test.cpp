// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes that a background announces and composite cannot read, or not yet; scenes that change while
// playing.

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "animated_file.h"
#include "composite_bench.h"
#include "element_test.h"
#include "scene/announcement.h"
#include "support/folder.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

/// Frames with a subject, each announced.
struct Announced : Bench {
  int number = 0;
  std::vector<Light> lights = synthetic::small_room(true).lights;
  ScenePose pose;
  explicit Announced(const char* backend = "processor") { show_subject(backend); }
  guint64 count(const char* name) const { return test::statistic(element, name); }
  std::vector<std::uint8_t> show(const std::string& scene, int version = 0) {
    Announcement announcement;
    announcement.viewport = synthetic::look_at({0, 1.2, 4.0}, {0, 1, 0}, width, height, 50.0);
    announcement.scene = scene;
    announcement.scene_version = version;
    announcement.lights = lights;
    announcement.pose = pose;
    gst_harness_push_event(background, announcement_event(announcement_to_json(announcement)));
    ++number;
    return bytes_taken(step(frame(frame_time(number - 1)), mesh_buffer(frame_time(number))));
  }
  /// Asks as scenesrc does whether composite has the scene ready.
  bool is_ready(const std::string& scene) {
    GstQuery* query = gst_query_new_custom(
        GST_QUERY_CUSTOM, gst_structure_new("polyhull-scene", "scene", G_TYPE_STRING, scene.c_str(),
                                            "version", G_TYPE_INT, 0, nullptr));
    fail_unless(gst_pad_peer_query(background->srcpad, query));
    gboolean ready = FALSE;
    fail_unless(gst_structure_get_boolean(gst_query_get_structure(query), "ready", &ready));
    gst_query_unref(query);
    return ready != FALSE;
  }
  void wait_until_ready(const std::string& scene) {
    for (int i = 0; !is_ready(scene); ++i) {
      fail_unless(i < 3000, "%s is not loaded", scene.c_str());
      g_usleep(10'000);
    }
  }
};

/// The small room with its walls and lamp \p wider, which is another picture.
void save_room(const std::string& path, float wider) {
  Scene room = synthetic::small_room(true);
  for (SceneMesh& mesh : room.meshes)
    for (Vec3f& position : mesh.positions) position.z *= wider;
  save_scene(room, path);
}

/// What a composite shows that has had no other scene.
std::vector<std::uint8_t> alone(const std::string& scene, const char* backend = "processor") {
  Announced bench(backend);
  return bench.show(scene);
}

/// Frames with a subject in the scene of the property.
struct Own : Bench {
  int number = 0;
  Own() {
    gst_util_set_object_arg(G_OBJECT(element), "backend", "processor");
    gst_harness_push(mesh, mesh_buffer(0));
  }
  std::vector<std::uint8_t> next() {
    ++number;
    return bytes_taken(step(frame(frame_time(number - 1)), mesh_buffer(frame_time(number))));
  }
  void set(const std::string& scene) { g_object_set(element, "scene", scene.c_str(), nullptr); }
};

}  // namespace

// While a file is announced that cannot be read, the scene before it stays as it is, read once.
ELEMENT_TEST(the_last_scene_stays) {
  const Folder folder;
  save_scene(synthetic::small_room(true), folder.file("good.glb"));
  Announced bench;
  for (int i = 0; i < 2; ++i) bench.show(folder.file("good.glb"));
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 1);
  // Even its file may go.
  std::filesystem::remove(folder.file("good.glb"));
  for (int i = 0; i < 3; ++i) bench.show(folder.file("missing.glb"));
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 3);
  fail_unless_equals_uint64(bench.count("drawn"), 5);
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 4);
  bench.show(folder.file("good.glb"));
  fail_unless_equals_uint64(bench.count("announcements"), 3);
  fail_unless_equals_uint64(bench.count("scene-depth-reused"), 5);
}

// A file that could not be read is read again when it has changed, not before.
ELEMENT_TEST(a_file_that_changes_is_tried_again) {
  const Folder folder;
  const std::string name = folder.file("late.glb");
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

// A scene is loaded beside from the first question on, and gives the picture that it gives alone; of
// the last two there is a way back at once, others are let go.
ELEMENT_TEST(what_is_asked_for_is_loaded_beside) {
  const Folder folder;
  const std::string a = folder.file("a.glb"), b = folder.file("b.glb"), c = folder.file("c.glb");
  save_room(a, 1.0f);
  save_room(b, 0.8f);
  save_room(c, 0.7f);
  const auto of_a = alone(a), of_b = alone(b);
  fail_unless(of_a != of_b);
  Announced bench;
  fail_unless(bench.show(a) == of_a);
  fail_if(bench.is_ready(b));
  fail_unless(bench.show(a) == of_a);
  bench.wait_until_ready(b);
  std::filesystem::remove(b);  // it is not read again
  fail_unless(bench.show(b) == of_b);
  fail_unless(bench.is_ready(a));
  fail_unless(bench.show(a) == of_a);
  fail_unless(bench.show(b) == of_b);
  bench.show(c);
  fail_unless(bench.is_ready(b));
  fail_if(bench.is_ready(a));
  fail_unless(bench.show(a) == of_a, "what is under way is waited for");
  // Of a file that is not there nothing is awaited.
  bench.is_ready(folder.file("missing.glb"));
  bench.wait_until_ready(folder.file("missing.glb"));
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 0);
}

// Of another version a file is read again, and not otherwise.
ELEMENT_TEST(a_file_written_anew_is_read_again) {
  const Folder folder;
  const std::string a = folder.file("a.glb");
  save_room(a, 1.0f);
  Announced bench;
  const auto before = bench.show(a);
  save_room(a, 0.8f);
  fail_unless(bench.show(a) == before);
  fail_unless(bench.show(a, 1) == alone(a));
  fail_unless(bench.show(a, 0) == before, "the one before is kept");
}

// A lamp that is seen hides and shades where it is announced to be, and no longer where the file has it:
// the picture is that of a file with the lamp there.
ELEMENT_TEST(lamps_are_where_they_are_announced) {
  const Folder folder;
  Scene room = synthetic::small_room(true);
  Light lamp{"lamp", {0.3f, 1.9f, 0.5f}, {0.3f, 0, 0}, {0, 0, 0.3f}, Vec3f(14.0f), -1};
  const auto save_with = [&](const std::string& name) {
    Scene scene = room;
    Material shining;
    shining.emission = lamp.radiance;
    scene.materials.push_back(shining);
    SceneMesh mesh;
    mesh.name = "lamp";
    mesh.material = static_cast<int>(scene.materials.size()) - 1;
    const Vec3f corner = lamp.centre - lamp.u - lamp.v;
    mesh.positions = {corner, corner + 2.0f * lamp.u, corner + 2.0f * lamp.u + 2.0f * lamp.v,
                      corner + 2.0f * lamp.v};
    mesh.normals.assign(4, Vec3f(0, -1, 0));
    mesh.triangles = {0, 1, 2, 0, 2, 3};
    scene.meshes.push_back(mesh);
    scene.lights.clear();
    save_scene(scene, folder.file(name));
    return load_scene(folder.file(name)).lights;
  };
  Announced at_once, moving;
  moving.lights = save_with("low.glb");
  lamp.centre = {0.1f, 2.4f, 0.6f};  // right above, so that the other would be before it
  at_once.lights = save_with("high.glb");
  fail_unless(moving.lights.size() == 1 && moving.lights[0].mesh >= 0);
  const auto low = moving.show(folder.file("low.glb"));
  const auto high = at_once.show(folder.file("high.glb"));
  const Light before = moving.lights[0];
  moving.lights[0].centre = lamp.centre;
  const auto moved = moving.show(folder.file("low.glb"));
  const auto apart = [](const auto& a, const auto& b) {
    int count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += std::abs(a[i] - b[i]) > 2;
    return count;
  };
  fail_unless(apart(low, high) > 1000);
  fail_unless(apart(moved, high) < 20, "%d", apart(moved, high));
  fail_unless(moving.show(folder.file("low.glb")) == moved);
  fail_unless(moving.count("scene-depth-reused") >= 1);
  moving.lights[0] = before;
  fail_unless(moving.show(folder.file("low.glb")) == low);
}

// A door that closes hides the subject and takes its shadow: as in a file in which it is closed.
static void check_nodes(const char* backend) {
  const Folder folder;
  const auto save_with_door = [&](const std::string& name, float x) {
    Scene scene = synthetic::small_room(true);
    SceneMesh door;
    door.name = "door";
    door.material = 1;
    door.positions = {{x, 0, 1.5f}, {x + 1, 0, 1.5f}, {x + 1, 2, 1.5f}, {x, 2, 1.5f}};
    door.normals.assign(4, Vec3f(0, 0, 1));
    door.triangles = {0, 1, 2, 0, 2, 3};
    scene.meshes.push_back(door);
    save_scene(scene, folder.file(name));
    return folder.file(name);
  };
  const std::string open = save_with_door("open.glb", 1.5f);
  const auto of_open = alone(open, backend),
             of_closed = alone(save_with_door("closed.glb", -0.5f), backend);
  fail_unless(of_open != of_closed);
  Announced bench(backend);
  fail_unless(bench.show(open) == of_open);
  bench.pose.nodes = "door move=-2,0,0";
  fail_unless(bench.show(open) == of_closed);
  bench.pose = {};
  fail_unless(bench.show(open) == of_open);
  bench.pose.nodes = "door move=-2";
  fail_unless(bench.show(open) == of_open);
  fail_unless_equals_uint64(bench.count("announcements-unusable"), 1);
  // An animation that closes the door hides the subject as the door does.
  add_animation(open, "close", {{"door", "translation", {0, 2}, {0, 0, 0, -2, 0, 0}}});
  Announced animated(backend);
  animated.pose = {"", 1, 0.0};
  fail_unless(animated.show(open) == of_open);
  animated.pose.animation_time = 2.0;
  fail_unless(animated.show(open) == of_closed);
  animated.pose.animation_time = 1.0;
  fail_unless(animated.show(open) != of_closed);
  animated.pose.animation = 2;
  animated.show(open);
  fail_unless_equals_uint64(animated.count("announcements-unusable"), 1);
}

ELEMENT_TEST(nodes_are_where_they_are_announced) {
  check_nodes("processor");
}

ELEMENT_TEST(nodes_are_where_they_are_announced_by_gl) {
  check_nodes("gl");
}

// Mirrors are chosen by the scene's names, from the next frame on.
ELEMENT_TEST(mirrors_are_chosen_by_name) {
  const Folder folder;
  Scene room = synthetic::small_room(true);
  fail_unless_equals_int(room.mirrors.size(), 1);
  room.meshes[static_cast<std::size_t>(room.mirrors[0].meshes[0])].name = "wet floor";
  save_scene(room, folder.file("room.glb"));
  Announced bench;
  const auto mirrors = [&](const char* choice) {
    g_object_set(bench.element, "mirrors", choice, nullptr);
    const guint64 before = bench.count("mirrors");
    bench.show(folder.file("room.glb"));
    return bench.count("mirrors") - before;
  };
  fail_unless_equals_uint64(mirrors("auto"), 1);
  fail_unless_equals_uint64(mirrors("-'wet floor'"), 0);
  fail_unless_equals_uint64(mirrors("'wet floor'"), 1);
  fail_unless_equals_uint64(bench.count("mirrors-missing"), 0);
  for (int i = 0; i < 3; ++i) fail_unless_equals_uint64(mirrors("lake"), 0);
  fail_unless_equals_uint64(bench.count("mirrors-missing"), 1);
}

// The property's scene: not live it is there with the next frame, live the last one goes on until then.
ELEMENT_TEST(the_propertys_scene_changes) {
  const Folder folder;
  const std::string a = folder.file("a.glb"), b = folder.file("b.glb");
  save_room(a, 1.0f);
  save_room(b, 0.8f);
  std::vector<std::uint8_t> of_a, of_b, of_none;
  {
    Own bench;
    bench.wait_for_all();
    of_none = bench.next();
    bench.set(a);
    of_a = bench.next();
    bench.set(b);
    of_b = bench.next();
    fail_unless(of_a != of_b && of_a != of_none);
    bench.set(folder.file("missing.glb"));
    for (int i = 0; i < 2; ++i) fail_unless(bench.next() == of_b);
    fail_unless_equals_uint64(statistic(bench.element, "scenes-unusable"), 1);
    bench.set(a);
    fail_unless(bench.next() == of_a);
    save_room(a, 0.8f);
    std::filesystem::last_write_time(a,
                                     std::filesystem::last_write_time(a) + std::chrono::seconds(2));
    fail_unless(bench.next() == of_a);
    bench.set(a);
    fail_unless(bench.next() == of_b);
    bench.set("");
    fail_unless(bench.next() == of_none);
  }
  save_room(a, 1.0f);
  Own live;
  live.set(a);
  fail_unless(live.next() == of_a);
  live.set(b);
  fail_unless(live.next() == of_a, "it is loaded beside");
  for (int i = 0; i < 3000 && live.next() != of_b; ++i) g_usleep(10'000);
  fail_unless(live.next() == of_b);
  live.set(a);
  fail_unless(live.next() == of_a, "the one before is there at once");
}
