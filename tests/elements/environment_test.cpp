// SPDX-License-Identifier: LGPL-2.1-or-later
// Environment pictures, from scenesrc to composite.
#include "environment_picture.h"

#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "base/srgb.h"
#include "builtin/shapes.h"
#include "composite_bench.h"
#include "controlled.h"
#include "element_test.h"
#include "scene/scene.h"
#include "shown_scene.h"

using namespace polyhull;
using namespace polyhull::test;

namespace {

std::string path_of(const char* name) {
  return folder.file(name);
}

/// A floor without any light.
std::string floor_file() {
  Scene scene;
  scene.materials.resize(1);
  scene.materials[0].base_colour = Vec3f(0.5f);
  scene.meshes = {parallelogram("floor", 0, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6})};
  save_scene(scene, path_of("floor.glb"));
  return path_of("floor.glb");
}

std::string environment_file(const char* name, const RadiancePicture& picture) {
  return write_bytes(path_of(name), hdr_bytes(picture));
}

std::vector<std::uint8_t> pixel(const std::string& frame, int x, int y) {
  const auto at = static_cast<std::size_t>(4 * (y * 32 + x));
  return {frame.begin() + static_cast<std::ptrdiff_t>(at),
          frame.begin() + static_cast<std::ptrdiff_t>(at) + 3};
}

}  // namespace

// An even light L is what is seen around, and a floor of albedo a under it shows a L: in linear values, with the
// exposure that makes white 0.6.
ELEMENT_TEST(the_environment_is_seen_and_lights) {
  const std::string around =
      environment_file("even.hdr", even_environment(Vec3f(1.0f, 0.5f, 0.25f)));
  Shown shown("num-buffers=1 refinement=never scene=" + floor_file() + " environment=" + around);
  shown.wait_for_end();
  fail_unless(shown.said.empty(), "%s", shown.said.empty() ? "" : shown.said[0].c_str());
  const Announcement& announced = shown.announced.at(0);
  fail_unless(announced.environment.name == around);
  fail_unless(announced.lights.empty() && announced.sky == Vec3f(1.0f));
  const float mean = (1.0f + 0.5f + 0.25f) / 3.0f;
  fail_unless(std::abs(announced.exposure * mean - 0.6f) < 2e-3f, "%g", announced.exposure);
  const auto is = [](const std::vector<std::uint8_t>& found, const Vec3f& linear) {
    for (int k = 0; k < 3; ++k) {
      const double expected = 255.0 * srgb_encoded(static_cast<double>(linear[k]));
      fail_unless(std::abs(found[static_cast<std::size_t>(k)] - expected) < 1.6, "%d not %g",
                  found[static_cast<std::size_t>(k)], expected);
    }
  };
  const Vec3f light = announced.exposure * Vec3f(1.0f, 0.5f, 0.25f);
  is(pixel(shown.frames[0], 16, 20), 0.5f * light);
  Shown up("num-buffers=1 refinement=never target=1,3,1.9 scene=" + floor_file() +
           " environment=" + around);
  up.wait_for_end();
  is(pixel(up.frames.at(0), 16, 12), glm::min(light, Vec3f(1.0f)));
}

// Set while playing it comes with the next frame, as if it had been there; so do its turn and its brightness.
ELEMENT_TEST(the_environment_changes_while_playing) {
  const std::string a = environment_file("a.hdr", outdoors(32)),
                    b = environment_file("b.hdr", even_environment(Vec3f(0.2f)));
  const std::string scene = "refinement=never target=0,2.2,0 scene=" + floor_file() + " ";
  Shown shown(scene + "num-buffers=8 environment=" + a, [&](Shown& self, std::size_t number) {
    if (number == 1) self.set("environment", b);
    if (number == 3) self.set("environment", a), self.set("environment-turn", "-30");
    if (number == 5) self.set("environment-intensity", "0.5");
  });
  shown.wait_for_end();
  const auto alone = [&](const std::string& properties) {
    Shown one(scene + "num-buffers=1 " + properties);
    one.wait_for_end();
    return one.frames.at(0);
  };
  fail_unless(shown.frames[1] == alone("environment=" + a));
  fail_unless(shown.frames[3] == alone("environment=" + b));
  fail_unless(shown.frames[5] == alone("environment-turn=-30 environment=" + a));
  fail_unless(shown.frames[5] != shown.frames[1]);
  fail_unless(shown.frames[7] != shown.frames[5]);
  fail_unless_equals_uint64(shown.count("light-fills"), 3);
  fail_unless(shown.announced[7].sky == Vec3f(0.5f));
  fail_unless(shown.announced[7].environment.turn == -30.0);
}

// Driven by a controller it is turned as it is at each frame's own time.
ELEMENT_TEST(controllers_turn_the_environment) {
  const std::string around = environment_file("a.hdr", outdoors(32));
  Shown shown("num-buffers=4 refinement=never scene=" + floor_file() + " environment=" + around,
              [](Shown& self, std::size_t number) {
                if (number == 0) control(self.source, "environment-turn", 0, 40, 80 * GST_MSECOND);
              });
  shown.wait_for_end();
  for (std::size_t i = 0; i < 4; ++i)
    fail_unless(std::abs(shown.announced.at(i).environment.turn - 10.0 * i) < 1e-6, "%zu", i);
}

ELEMENT_TEST(a_broken_environment_is_said) {
  const std::string good = environment_file("good.hdr", even_environment(Vec3f(1.0f))),
                    broken = path_of("broken.hdr");
  const std::string whole = hdr_bytes(outdoors(32));
  write_bytes(broken, whole.substr(0, whole.size() / 2));
  Shown shown("num-buffers=4 scene=" + floor_file() + " environment=" + good,
              [&](Shown& self, std::size_t number) {
                if (number == 1) self.set("environment", broken);
              });
  shown.wait_for_end();
  fail_unless_equals_int(shown.said.size(), 1);
  fail_unless(shown.said[0].find("cut off in row") != std::string::npos, "%s",
              shown.said[0].c_str());
  fail_unless_equals_uint64(shown.count("scenes-unusable"), 1);
  fail_unless(shown.announced.back().environment.name == good);
}

/// composite with a subject, a frame for each announcement of scenesrc's.
struct Announced : Bench {
  GstClockTime time = 0;
  explicit Announced(const char* backend) { show_subject(backend); }
  GstBuffer* show(const Announcement& announced) {
    gst_harness_push_event(background, announcement_event(announcement_to_json(announced)));
    const GstClockTime now = std::exchange(time, time + 40 * GST_MSECOND);
    return step(opaque_frame(now), mesh_buffer(time));
  }
};

/// How many pixels the subject changes; -1: the announcement is not usable.
static int changed_by(const Announcement& announced, const char* backend) {
  Announced bench(backend);
  GstBuffer* picture = bench.show(announced);
  const int count = changed_pixels(picture);
  gst_buffer_unref(picture);
  const bool usable = test::statistic(bench.element, "announcements-unusable") == 0;
  return usable ? count : -1;
}

// The subject takes the environment's light from the floor; a picture that is gone is said.
ELEMENT_TEST(subjects_throw_its_shadow) {
  const std::string around = environment_file("outdoors.hdr", outdoors(64));
  Shown shown("num-buffers=1 refinement=never eye=0,1.2,4 target=0,1,0 scene=" + floor_file() +
              " environment=" + around);
  shown.wait_for_end();
  Announcement announced = shown.announced.at(0);
  for (const char* backend : {"processor", "gl"}) {
    const int with = changed_by(announced, backend);
    Announcement dark = announced;
    dark.sky = Vec3f(0.0f);
    const int without = changed_by(dark, backend);
    fail_unless(without > 500 && with > without + 1000, "%s: %d and %d pixels", backend, with,
                without);
  }
  announced.environment.name = path_of("gone.hdr");
  fail_unless_equals_int(changed_by(announced, "processor"), -1);
}

// Its lights are as far away as the scene is large in the pose that it has now.
ELEMENT_TEST(its_lights_lie_around_the_scene_as_it_stands) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes = {parallelogram("floor", 0, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6}),
                  box("post", 0, {2, 0, -2}, {2.2f, 1, -1.8f})};
  save_scene(scene, path_of("post.glb"));
  Shown shown(
      "num-buffers=1 refinement=never eye=0,1.2,4 target=0,1,0 scene=" + path_of("post.glb") +
      " environment=" + environment_file("outdoors.hdr", outdoors(64)));
  shown.wait_for_end();
  Announcement announced = shown.announced.at(0), moved = announced;
  moved.pose.nodes = "post move=400,0,0";
  Announced bench("processor"), fresh("processor");
  const auto before = bytes_taken(bench.show(announced)), after = bytes_taken(bench.show(moved));
  fail_unless(before != after);
  fail_unless(after == bytes_taken(fresh.show(moved)));
}
