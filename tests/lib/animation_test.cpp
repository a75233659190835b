// SPDX-License-Identifier: LGPL-2.1-or-later
// Animations of a scene's nodes: values between keys, files, poses, and views of what has moved.
#include "scene/animation/animation.h"

#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <string>
#include <vector>

#include "animated_file.h"
#include "builtin/shapes.h"
#include "scene/assumed_light.h"
#include "scene/changes/scene_changes.h"
#include "scene_file.h"
#include "view/background.h"
#include "view/scene_planes.h"

namespace polyhull {
namespace {

using test::add_animation;
using test::Channel;
using Track = AnimationTrack;

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

/// A turn by \p degrees about y, as glTF has it.
Vec4 turn(double degrees) {
  const double half = glm::radians(degrees) / 2.0;
  return {0.0, std::sin(half), 0.0, std::cos(half)};
}

double distance(const Vec4& a, const Vec4& b) {
  return glm::length(a - b);
}

TEST(AnimationTrackTest, StepsAndLines) {
  Track track{Track::Part::translation, Track::Interpolation::linear, {1.0, 3.0, 4.0}, {}};
  track.values = {{0, 0, 0, 0}, {4, -2, 1, 0}, {4, 0, 0, 0}};
  EXPECT_EQ(track.at(0.0), track.values[0]);
  EXPECT_EQ(track.at(1.0), track.values[0]);
  EXPECT_EQ(track.at(2.0), Vec4(2, -1, 0.5, 0));
  EXPECT_EQ(track.at(3.0), track.values[1]);
  EXPECT_EQ(track.at(9.0), track.values[2]);
  track.interpolation = Track::Interpolation::step;
  EXPECT_EQ(track.at(2.999), track.values[0]);
  EXPECT_EQ(track.at(3.0), track.values[1]);
  EXPECT_EQ(track.at(9.0), track.values[2]);
}

// Hermite's spline through a cubic's values and slopes is the cubic.
TEST(AnimationTrackTest, SplinesAreExactForCubics) {
  Track track{Track::Part::scale, Track::Interpolation::cubic, {0.5, 2.0, 3.5}, {}};
  const auto value = [](double t) { return Vec4(t * t * t, 2 - t, t * t, 0); };
  const auto slope = [](double t) { return Vec4(3 * t * t, -1, 2 * t, 0); };
  for (const double t : track.times)
    for (const Vec4& v : {slope(t), value(t), slope(t)}) track.values.push_back(v);
  for (double t = 0.5; t <= 3.5; t += 0.125) EXPECT_LT(distance(track.at(t), value(t)), 1e-12) << t;
  EXPECT_EQ(track.at(7.0), value(3.5));
}

TEST(AnimationTrackTest, TurnsTakeTheShorterWayAtEvenSpeed) {
  Track track{Track::Part::rotation, Track::Interpolation::linear, {0.0, 1.0}, {}};
  for (const double sign : {1.0, -1.0}) {  // both quaternions are the same turn
    track.values = {turn(10), sign * turn(130)};
    for (double s = 0.0; s <= 1.0; s += 0.125) {
      const Vec4 at = track.at(s), wanted = turn(10 + 120 * s);
      EXPECT_LT(std::min(distance(at, wanted), distance(at, -wanted)), 1e-12) << s;
    }
  }
  track.values = {turn(0), turn(1e-9)};
  EXPECT_LT(distance(track.at(0.5), turn(5e-10)), 1e-12);
  track.interpolation = Track::Interpolation::cubic;
  const Vec4 still(0.0);
  track.values = {still, turn(0), still, still, 2.0 * turn(90), still};
  EXPECT_NEAR(glm::length(track.at(0.3)), 1.0, 1e-12);
  EXPECT_LT(distance(track.at(1.0), turn(90)), 1e-12);
}

TEST(AnimationTest, ChoicesAndTimes) {
  const std::vector<Animation> two = {{"open", {}, 2.0}, {"1", {}, 0.0}};
  EXPECT_EQ(find_animation(two, ""), 1);
  EXPECT_EQ(find_animation({}, ""), 0);
  EXPECT_EQ(find_animation(two, "open"), 1);
  EXPECT_EQ(find_animation(two, "1"), 2) << "names come first";
  EXPECT_EQ(find_animation(two, "2"), 2);
  EXPECT_EQ(find_animation(two, "0"), 0);
  for (const char* other : {"3", "-1", "shut", "2x", " "})
    EXPECT_EQ(find_animation(two, other), std::nullopt) << other;
  EXPECT_EQ(time_in(two[0], 5.5, true), 1.5);
  EXPECT_EQ(time_in(two[0], 5.5, false), 2.0);
  EXPECT_EQ(time_in(two[0], -1.0, true), 0.0);
  EXPECT_EQ(time_in(two[1], 5.5, true), 0.0);
}

class AnimatedFile : public SceneFile {
 protected:
  /// A floor, and a box at 2, 0, 0 under a lamp.
  std::string box_file() {
    Scene scene;
    scene.materials.resize(2);
    scene.materials[1].emission = Vec3f(8.0f);
    scene.meshes = {parallelogram("floor", 0, {-4, 0, 4}, {8, 0, 0}, {0, 0, -8}),
                    box("box", 0, {1.5f, 0, -0.5f}, {2.5f, 1, 0.5f}),
                    parallelogram("lamp", 1, {-0.5f, 3, -0.5f}, {1, 0, 0}, {0, 0, 1})};
    scene.cameras = {look_at({0, 2, 5}, {0, 0, 0}, 40, 1280, 720)};
    scene.cameras[0].name = "eye";
    const std::string path = folder_.file("box.glb");
    save_scene(scene, path);
    return path;
  }
  std::string with(const Channel& channel) {
    const std::string path = box_file();
    add_animation(path, "spin", {channel});
    return path;
  }
};

Channel spin(const std::string& node) {
  Channel channel{node, "rotation", {}, {}};
  for (int k = 0; k <= 4; ++k) {
    channel.times.push_back(static_cast<float>(k));
    const Vec4 q = turn(90.0 * k);
    for (int i = 0; i < 4; ++i) channel.values.push_back(static_cast<float>(q[i]));
  }
  return channel;
}

TEST_F(AnimatedFile, ANodeTurnsAsItsKeysSay) {
  const Scene rest = load_scene(with(spin("box")));
  ASSERT_TRUE(rest.animations);
  EXPECT_EQ(rest.animations->at(0).name, "spin");
  EXPECT_EQ(rest.animations->at(0).duration, 4.0);
  EXPECT_EQ(rest.left_out, "");
  for (const double time : {0.0, 0.5, 1.0, 1.75, 3.999}) {
    Scene posed = rest;
    EXPECT_EQ(pose_scene({"", 1, time}, posed), "");
    const double angle = glm::radians(90.0 * time), c = std::cos(angle), s = std::sin(angle);
    for (std::size_t i = 0; i < rest.meshes[1].positions.size(); ++i) {
      const Vec3f p = rest.meshes[1].positions[i];
      const Vec3f wanted(c * p.x + s * p.z, p.y, c * p.z - s * p.x);
      EXPECT_LT(glm::length(posed.meshes[1].positions[i] - wanted), 1e-6f) << time;
    }
    EXPECT_EQ(posed.meshes[0].positions, rest.meshes[0].positions);
    EXPECT_EQ(posed.lights, rest.lights);
  }
  // What people change comes on top, along the scene's axes.
  Scene posed = rest;
  pose_scene({"box move=0,1,0 turn=0,-90,0", 1, 1.0}, posed);
  const Vec3f p = rest.meshes[1].positions[0];
  EXPECT_LT(glm::length(posed.meshes[1].positions[0] - (p + Vec3f(0, 1, 0))), 1e-5f);
  EXPECT_THROW(pose_scene({"", 2, 0.0}, posed), Error);
}

TEST_F(AnimatedFile, LampsGoAlongAndVanishWhereTheyAreFlat) {
  const std::string path = box_file();
  add_animation(path, "lower", {{"lamp", "translation", {0, 1}, {0, 0, 0, 0, -1, 0}}});
  add_animation(path, "close",
                {{"lamp", "scale", {0, 1}, {1, 1, 1, 0, 1, 0}},
                 {"box", "scale", {0, 1}, {1, 1, 1, 0, 0, 0}}});
  const Scene rest = load_scene(path);
  Scene posed = rest;
  pose_scene({"", 1, 0.5}, posed);
  EXPECT_LT(std::abs(posed.lights[0].centre.y - 2.5f), 1e-6f);
  EXPECT_EQ(posed.meshes[2].positions[0].y, 2.5f);
  posed = rest;
  pose_scene({"", 2, 1.0}, posed);
  EXPECT_EQ(posed.lights[0].radiance, Vec3f(0.0f));
  for (const Vec3f& p : posed.meshes[1].positions) EXPECT_EQ(p, Vec3f(0.0f));
  for (const Vec3f& n : posed.meshes[1].normals) EXPECT_NEAR(glm::length(n), 1.0f, 1e-6f);
}

// A scale below 0 makes a mirror image, as a file has it whose node is scaled so: what was outside stays outside.
TEST_F(AnimatedFile, MirrorImagesAreNotInsideOut) {
  const std::string path = box_file();
  const std::vector<float> to_mirror = {1, 1, 1, -1, 1, 1};
  add_animation(path, "swap",
                {{"box", "scale", {0, 1}, to_mirror}, {"lamp", "scale", {0, 1}, to_mirror}});
  Scene posed = load_scene(path);
  const Vec3f shines = glm::cross(posed.lights[0].u, posed.lights[0].v);
  pose_scene({"", 1, 1.0}, posed);
  test::change_json(path, [](json& root) {
    for (const std::size_t node : {1, 2}) root["nodes"][node]["scale"] = {-1, 1, 1};
  });
  const Scene file = load_scene(path);
  for (std::size_t m = 0; m < file.meshes.size(); ++m) {
    EXPECT_EQ(posed.meshes[m].positions, file.meshes[m].positions) << m;
    EXPECT_EQ(posed.meshes[m].normals, file.meshes[m].normals) << m;
    EXPECT_EQ(posed.meshes[m].triangles, file.meshes[m].triangles) << m;
  }
  const auto shines_in = [](const Scene& scene) {
    return glm::cross(scene.lights[0].u, scene.lights[0].v);
  };
  EXPECT_LT(glm::length(shines_in(posed) - shines), 1e-6f);
  EXPECT_LT(glm::length(shines_in(file) - shines), 1e-6f);
}

// The mirror image of a sun stands where that of its place is, and shines at the scene.
TEST(AnimationTest, SunsAreMirrored) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes = {parallelogram("floor", 0, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2})};
  assume_light(scene);
  const Light before = scene.lights[0];
  scene.nodes = {{"sun", -1, Mat4(1.0)}};
  scene.lights[0].node = 0;
  NodeMotion mirrored;
  mirrored.tracks = {{Track::Part::scale, Track::Interpolation::step, {0.0}, {{-1, 1, 1, 0}}}};
  scene.animations = std::make_shared<const std::vector<Animation>>(
      std::vector<Animation>{{"swap", {mirrored}, 0.0}});
  pose_scene({"", 1, 0.0}, scene);
  const Light& after = scene.lights[0];
  EXPECT_EQ(after.centre, before.centre * Vec3f(-1, 1, 1));
  EXPECT_GT(glm::dot(glm::normalize(glm::cross(after.u, after.v)), -glm::normalize(after.centre)),
            0.9999f);
}

TEST_F(AnimatedFile, WhatIsBrokenIsRefused) {
  const auto why = [&](const Channel& channel) { return failure(with(channel)); };
  const std::vector<float> three = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  EXPECT_EQ(why({"box", "translation", {0, 1, 2}, three}), "");
  const std::string unsorted = why({"box", "translation", {0, 2, 1}, three});
  EXPECT_TRUE(contains(unsorted,
                       "animation 1 'spin' whose channel 0 (node 'box') has keys that are "
                       "not in the order of their times: key 2 at 1 s follows one at 2 s"))
      << unsorted;
  EXPECT_TRUE(contains(why({"box", "translation", {0, not_a_number, 2}, three}),
                       "key 1 at a time that is not finite"));
  EXPECT_TRUE(contains(why({"box", "scale", {0, 1, 2}, {1, 1, 1, 1, not_a_number, 1, 1, 1, 1}}),
                       "value 1 that is not finite"));
  EXPECT_TRUE(contains(why({"box", "translation", {0, 1}, three}), "2 keys but 3 values"));
  EXPECT_TRUE(contains(why({"box", "translation", {0, 1, 2}, three, "CUBICSPLINE"}),
                       "3 keys but 3 values; expected 9"));
  EXPECT_TRUE(contains(why({"box", "translation", {0, 1, 2}, three, "EASE"}), "'EASE'; expected"));
  const std::string none = with({"box", "translation", {0, 1, 2}, three});
  test::change_json(none, [](json& root) {
    for (const char* end : {"input", "output"})
      root["accessors"][root["animations"][0]["samplers"][0][end].get<std::size_t>()]["count"] = 0;
  });
  EXPECT_TRUE(contains(failure(none), "has no keys"));
}

// Keys count in each place that a node hangs in, where each is held.
TEST_F(AnimatedFile, TooManyKeysAreRefused) {
  constexpr std::size_t keys = 900'000;
  Channel many{"box", "translation", std::vector<float>(keys), std::vector<float>(3 * keys)};
  const std::string path = with(many);
  EXPECT_EQ(failure(path), "");
  test::change_json(path, [](json& root) {
    for (int i = 0; i < 11; ++i) root["scenes"][0]["nodes"].push_back(1);
  });
  EXPECT_TRUE(contains(failure(path), "too large: its animations have more than 10000000"));
}

TEST_F(AnimatedFile, WhatIsNotDoneIsSaid) {
  const std::string path = with({"box", "weights", {0, 1}, {0, 1}});
  EXPECT_EQ(load_scene(path).left_out, "animated morphs");
  const std::string eye = with({"eye", "translation", {0, 1}, {0, 0, 0, 1, 0, 0}});
  test::change_json(eye, [](json& root) {
    for (json& node : root["nodes"]) node.erase("matrix");
  });
  const Scene camera_alone = load_scene(eye);
  EXPECT_TRUE(contains(camera_alone.left_out, "animations of cameras"));
  EXPECT_TRUE(camera_alone.animations->at(0).motions.empty());
  const auto said = [&](const char* part, const json& value) {
    const std::string of = with(spin("box"));
    test::change_json(of, [&](json& root) { root["nodes"][1][part] = value; });
    const Scene scene = load_scene(of);
    EXPECT_TRUE(scene.animations->at(0).motions.empty());
    return scene.left_out;
  };
  EXPECT_TRUE(contains(said("scale", {0, 1, 1}), "that the file scales to nothing"));
  EXPECT_TRUE(contains(said("matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}),
                       "that have a matrix"));
}

const Camera camera = look_at({2, 4, 7}, {0, 0.5, 0}, 50, 96, 72);

BackgroundOptions coarse() {
  BackgroundOptions options;
  options.light.spacing = 0.5f;
  options.light.bounce_spacing = 1.0f;
  return options;
}

// Of black things that glow the light says nothing: what has moved looks as if it had been opened there.
TEST_F(AnimatedFile, AViewShowsWhatHasMovedWhereItIs) {
  Scene rest = load_scene(with(spin("box")));
  for (Material& material : rest.materials) {
    material.base_colour = Vec3f(0.0f);
    material.emission += Vec3f(0.2f);
  }
  Scene posed = rest;
  pose_scene({"", 1, 0.7}, posed);
  Background moved(rest, coarse()), opened(posed, coarse());
  opened.update(camera, posed.lights, 1.0f);
  moved.update(camera, rest.lights, 1.0f);
  EXPECT_NE(moved.picture(), opened.picture());
  ASSERT_TRUE(moved.take_pose(posed));
  EXPECT_EQ(moved.update(camera, posed.lights, 1.0f), Background::Work::drawn);
  EXPECT_EQ(moved.picture(), opened.picture());
  EXPECT_EQ(moved.planes()->geometry, geometry_key(posed));
  EXPECT_FALSE(moved.light_is_exact());
  Scene hidden = rest;
  pose_scene({"box visible=no"}, hidden);
  EXPECT_FALSE(moved.take_pose(hidden));
  // As many meshes of the same form, and yet others.
  Scene other = posed;
  other.meshes[1].node = 0;
  EXPECT_FALSE(moved.take_pose(other));
  EXPECT_EQ(moved.update(camera, posed.lights, 1.0f), Background::Work::none);
}

// The light on what moves is that of before, whatever becomes of the lamp, and is dimmed with it.
TEST_F(AnimatedFile, TheLightOfBeforeGoesAlong) {
  const std::string path = box_file();
  add_animation(path, "lower", {{"lamp", "translation", {0, 1}, {0, 0, 0, 0, -1, 0}}});
  const Scene rest = load_scene(path);
  Background background(rest, coarse());
  background.update(camera, rest.lights, 1.0f);
  const std::vector<Vec3f> before = background.picture();
  Scene posed = rest;
  pose_scene({"", 1, 1.0}, posed);
  ASSERT_TRUE(background.take_pose(posed));
  EXPECT_EQ(background.update(camera, posed.lights, 1.0f), Background::Work::drawn);
  const std::size_t floor = 60 * 96 + 48;  // a pixel of it
  EXPECT_EQ(background.picture()[floor], before[floor]);
  std::vector<Light> half = posed.lights;
  for (Light& light : half) light.radiance *= 0.5f;
  EXPECT_EQ(background.update(camera, half, 1.0f), Background::Work::drawn);
  EXPECT_LT(glm::length(background.picture()[floor] - 0.5f * before[floor]), 1e-6f);
}

}  // namespace
}  // namespace polyhull
