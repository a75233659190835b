// SPDX-License-Identifier: LGPL-2.1-or-later
// What people ask of a scene's lights and nodes.
#include "scene/changes/scene_changes.h"

#include <gtest/gtest.h>

#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "builtin/shapes.h"
#include "scene/assumed_light.h"
#include "scene/changes/mirror_choice.h"
#include "scene_file.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

/// A floor, a lamp that is seen, a point called as that, and a spot.
Scene lit_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].emission = Vec3f(2.0f, 4.0f, 1.0f);
  scene.meshes = {parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                  parallelogram("lamp", 1, {-0.5f, 2, -0.5f}, {1, 0, 0}, {0, 0, 1})};
  Light lamp{"lamp", {0, 2, 0}, {0.5f, 0, 0}, {0, 0, 0.5f}, {2, 4, 1}, 1};
  Light point{"lamp", {1, 1, 1}, Vec3f(0.0f), Vec3f(0.0f), {3, 3, 3}, -1};
  Light spot{"key light", {0, 3, 0}, {0.1f, 0, 0}, {0, 0, 0.1f}, {9, 9, 9}, -1, 0.3f, 0.4f};
  scene.lights = {lamp, point, spot};
  return scene;
}

std::vector<Light> changed(const std::string& text, const Scene& scene,
                           std::string* said = nullptr) {
  std::vector<Light> lights = scene.lights;
  const std::string missing =
      change_lights(parse_light_changes(text), scene_bounds(scene), "room.glb", lights);
  if (said)
    *said = missing;
  else
    EXPECT_EQ(missing, "") << text;
  return lights;
}

TEST(LightChangesTest, WhoIsMeant) {
  const Scene scene = lit_scene();
  const auto darkened = [&](const std::string& text) {
    std::string which;
    for (const Light& light : changed(text, scene))
      which += light.radiance == Vec3f(0.0f) ? '1' : '0';
    return which;
  };
  EXPECT_EQ(darkened(""), "000");
  EXPECT_EQ(darkened(" ; ;"), "000");
  EXPECT_EQ(darkened("lamp intensity=0"), "110");
  EXPECT_EQ(darkened("2 intensity=0"), "010");
  EXPECT_EQ(darkened("\"key light\" intensity=0; 1 intensity=0;"), "101");
  EXPECT_EQ(darkened("'key light'\n  intensity=0"), "001");
  EXPECT_EQ(darkened("* intensity=0"), "111");
  Scene numbered = scene;
  numbered.lights[2].name = "2";
  std::vector<Light> lights = changed("\"2\" intensity=0", numbered);
  EXPECT_NE(lights[1].radiance, Vec3f(0.0f));
  EXPECT_EQ(lights[2].radiance, Vec3f(0.0f));
}

TEST(LightChangesTest, WhoIsNotThere) {
  const Scene scene = lit_scene();
  std::string said;
  const std::vector<Light> lights =
      changed("sun intensity=2; 4 size=2; 2 intensity=2", scene, &said);
  EXPECT_EQ(
      said,
      "The scene 'room.glb' has no light 'sun', '4'; it has 1 'lamp', 2 'lamp', 3 'key light'.");
  EXPECT_EQ(lights[1].radiance, Vec3f(6.0f)) << "the others are changed";
  EXPECT_EQ(lights[0], scene.lights[0]);
}

TEST(LightChangesTest, WhatIsNotUnderstood) {
  for (const char* text :
       {"lamp intensity", "lamp intensity=", "lamp intensity=-1", "lamp intensity=nan",
        "lamp intensity=inf", "lamp intensity=1e9", "lamp intensity=1x", "lamp colour=1,2",
        "lamp colour=1,2,3,4", "lamp colour=1,-2,3", "lamp move=1;2;3", "lamp move=1,2,nan",
        "lamp turn=90", "lamp size=0", "lamp size=2,2", "lamp brightness=1", "intensity=1",
        "\"lamp intensity=1", "lamp 2 intensity=1"})
    test::expect_refused([&] { parse_light_changes(text); }, "not understood at '");
}

TEST(LightChangesTest, BrightnessAndColour) {
  const Scene scene = lit_scene();
  EXPECT_EQ(changed("1 intensity=0.5", scene)[0].radiance, Vec3f(1.0f, 2.0f, 0.5f));
  EXPECT_EQ(changed("1 intensity=.5 intensity=.5", scene)[0].radiance, Vec3f(0.5f, 1.0f, 0.25f));
  EXPECT_EQ(changed("1 colour=1,.5,0", scene)[0].radiance, Vec3f(4.0f, 2.0f, 0.0f));
  EXPECT_EQ(changed("lamp intensity=2; 1 colour=1,1,1", scene)[0].radiance, Vec3f(8.0f));
}

/// The power of an area light is its radiance times its area times pi.
TEST(LightChangesTest, SizeKeepsThePower) {
  const Scene scene = lit_scene();
  for (const std::size_t i : {0u, 2u}) {
    const Light before = scene.lights[i];
    const Light after = changed("* size=3", scene)[i];
    EXPECT_FLOAT_EQ(glm::length(after.u), 3.0f * glm::length(before.u));
    EXPECT_NEAR(glm::length(glm::cross(after.u, after.v)) * after.radiance.x,
                glm::length(glm::cross(before.u, before.v)) * before.radiance.x, 1e-4);
    EXPECT_EQ(after.outer_cone, before.outer_cone);
  }
  EXPECT_EQ(changed("2 size=3", scene)[1], scene.lights[1]);
}

TEST(LightChangesTest, MovesAndTurns) {
  const Scene scene = lit_scene();
  const auto near = [](const Vec3f& a, const Vec3f& b) {
    EXPECT_LT(glm::length(a - b), 1e-5f) << a.x << ' ' << a.y << ' ' << a.z;
  };
  near(changed("1 move=0.5,-1,2", scene)[0].centre, {0.5f, 1.0f, 2.0f});
  // z goes to x about y, x to y about z, y to z about x; x first.
  Light turned = changed("1 turn=0,90,0", scene)[0];
  near(turned.u, {0, 0, -0.5f});
  near(turned.v, {0.5f, 0, 0});
  near(turned.centre, scene.lights[0].centre);
  turned = changed("1 turn=90,0,90", scene)[0];
  near(turned.u, {0, 0.5f, 0});
  near(turned.v, {0.5f, 0, 0});
  turned = changed("1 turn=0,90,0; 1 turn=0,-90,0", scene)[0];
  near(turned.u, scene.lights[0].u);
}

/// A sun goes around the scene and shines at it from wherever it is.
TEST(LightChangesTest, ASunGoesAround) {
  Scene scene = lit_scene();
  scene.lights.clear();
  assume_light(scene);
  const Bounds bounds = scene_bounds(scene);
  const Vec3f middle(0.5 * (bounds.min + bounds.max));
  const Light before = scene.lights[0], after = changed("1 turn=0,90,0", scene)[0];
  const Vec3f from = before.centre - middle, to = after.centre - middle;
  EXPECT_LT(glm::length(to - Vec3f(from.z, from.y, -from.x)), 1e-4f * glm::length(from));
  EXPECT_GT(glm::dot(glm::normalize(glm::cross(after.u, after.v)), -glm::normalize(to)), 0.9999f);
}

/// Whatever adds up can be drawn with.
TEST(LightChangesTest, NothingOverflows) {
  const auto repeated = [](const std::string& word) {
    std::string text;
    for (int i = 0; i < 20; ++i) text += word;
    return text;
  };
  for (const std::string& text :
       {repeated("* intensity=1e6 size=1000 move=1e6,1e6,1e6;"), repeated("* size=0.001;"),
        "* colour=1,0,0" + repeated(" intensity=1e6"), "*" + repeated(" size=1000"),
        "*" + repeated(" size=0.001")})
    for (const Light& light : changed(text, lit_scene())) {
      const bool was_point = light.u == Vec3f(0.0f);
      EXPECT_LT(light.radiance.x + light.radiance.y + light.radiance.z,
                std::numeric_limits<float>::max())
          << text;
      EXPECT_LT(glm::length(light.centre) + glm::length(light.u) + glm::length(light.v), 1e9f)
          << text;
      EXPECT_NE(light.is_area(), was_point) << text;
    }
}

TEST(LightChangesTest, LampsFollow) {
  const Scene scene = lit_scene();
  std::vector<Light> lights = changed("* intensity=0.5", scene);
  EXPECT_FALSE(lamps_differ(scene, lights)) << "brightness moves nothing";
  lights = changed("* move=0,-0.5,0 size=2", scene);
  EXPECT_TRUE(lamps_differ(scene, lights));
  Scene moved = scene;
  move_lamps(moved, lights);
  EXPECT_FALSE(lamps_differ(moved, lights));
  EXPECT_EQ(moved.meshes[0].positions, scene.meshes[0].positions);
  EXPECT_LT(glm::length(moved.meshes[1].positions[0] - Vec3f(-1, 1.5f, -1)), 1e-5f);
  EXPECT_EQ(moved.lights[0].radiance, scene.lights[0].radiance);
  // Fewer or more lights than the scene's, as of an announcement.
  lights.resize(1);
  EXPECT_TRUE(lamps_differ(scene, lights));
  lights.resize(9);
  EXPECT_TRUE(lamps_differ(scene, lights));
  EXPECT_FALSE(lamps_differ(scene, {}));
}

Mat4 at(double x) {
  return glm::translate(Mat4(1.0), Vec3(x, 0.0, 0.0));
}

/// A frame, and on it a door with a lamp behind another lamp's mesh; nothing else moves.
Scene with_door() {
  Scene scene = lit_scene();
  scene.nodes = {{"house", -1, at(0)}, {"frame", 0, at(1)}, {"door", 1, at(2)}};
  scene.meshes[0].node = 0;
  scene.meshes.insert(scene.meshes.begin(),
                      parallelogram("leaf", 0, {2, 0, 0}, {1, 0, 0}, {0, 2, 0}));
  scene.meshes[0].node = 2;
  scene.meshes[2].node = 0;
  scene.lights[0].mesh = 2;
  scene.lights[0].node = 0;
  scene.lights[2].node = 2;  // the spot, at 0,3,0
  return scene;
}

Scene with(const std::string& changes, std::string* said = nullptr) {
  Scene scene = with_door();
  scene.name = "house.glb";
  const std::string missing = pose_scene({changes}, scene);
  if (said)
    *said = missing;
  else
    EXPECT_EQ(missing, "") << changes;
  return scene;
}

void expect_near(const Vec3f& a, const Vec3f& b) {
  EXPECT_LT(glm::length(a - b), 1e-5f) << a.x << ' ' << a.y << ' ' << a.z;
}

TEST(NodeChangesTest, ADoorTurnsInItsHinge) {
  const Scene scene = with("door turn=0,90,0");
  expect_near(scene.meshes[0].positions[0], {2, 0, 0});
  expect_near(scene.meshes[0].positions[1], {2, 0, -1});
  expect_near(scene.meshes[0].normals[0], {1, 0, 0});
  EXPECT_EQ(scene.meshes[1].positions, with_door().meshes[1].positions);
  // What hangs on it goes with it: from 2 m left of the hinge to 2 m before it.
  expect_near(scene.lights[2].centre, {2, 3, 2});
  expect_near(scene.lights[2].u, {0, 0, -0.1f});
  EXPECT_EQ(scene.lights[0], with_door().lights[0]);
}

TEST(NodeChangesTest, WhatIsAboveComesOnTop) {
  const Scene scene = with("door move=1,0,0; frame turn=0,90,0 move=0,0,5; door scale=2");
  // The door's corner: 2,0,0, scaled there, then 1 to the right; turned about 1,0,0 and moved.
  expect_near(scene.meshes[0].positions[0], {1, 0, 3});
  expect_near(scene.meshes[0].positions[1], {1, 0, 1});
  EXPECT_NEAR(glm::length(scene.meshes[0].normals[0]), 1.0f, 1e-5f);
}

TEST(NodeChangesTest, WhatIsHiddenIsGone) {
  Scene scene = with("door visible=no");
  EXPECT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.lights.size(), 3u) << "numbers stay";
  EXPECT_EQ(scene.lights[2].radiance, Vec3f(0.0f));
  EXPECT_EQ(scene.meshes[static_cast<std::size_t>(scene.lights[0].mesh)].name, "lamp");
  EXPECT_EQ(with("frame visible=no").meshes.size(), 2u) << "with all below";
  EXPECT_EQ(with("frame visible=no; door visible=yes").meshes.size(), 2u);
  EXPECT_THROW(with("house visible=no"), Error);
  EXPECT_EQ(with("door visible=no; door visible=yes").meshes.size(), with("").meshes.size());
  std::string often;
  for (int i = 0; i < 13; ++i) often += "door scale=1000;";
  EXPECT_THROW(with(often), Error) << "beyond all reach";
}

TEST(NodeChangesTest, NamesAndWords) {
  std::string said;
  with("gate visible=no; door move=0,0,0", &said);
  EXPECT_EQ(said, "The scene 'house.glb' has no node 'gate'; it has 'house', 'frame', 'door'.");
  for (const char* text : {"door visible=maybe", "door open=1", "door scale=0", "door move=1"})
    EXPECT_THROW(parse_node_changes(text), Error) << text;
  // In a scene without nodes each mesh is one.
  Scene plain = lit_scene();
  EXPECT_EQ(pose_scene({"lamp move=0,0.5,0"}, plain), "");
  expect_near(plain.lights[0].centre, {0, 2.5f, 0});
  EXPECT_FLOAT_EQ(plain.meshes[1].positions[0].y, 2.5f);
}

TEST(MirrorChoiceTest, NamesAndMinuses) {
  const auto choice = [](const char* text) { return parse_mirror_choice(text); };
  for (const char* all : {"", "auto", " ; "})
    EXPECT_TRUE(choice(all).shown.empty() && choice(all).left_out.empty()) << all;
  EXPECT_EQ(choice("floor; \"tall one\"").shown, (std::vector<std::string>{"floor", "tall one"}));
  EXPECT_EQ(choice("-a;-'b c' ; d").left_out, (std::vector<std::string>{"a", "b c"}));
  EXPECT_EQ(choice("\"-a\"; 'auto'").shown, (std::vector<std::string>{"-a", "auto"}));
  for (const char* text : {"-", "floor wall", "\"open", "- ;a", "''"})
    EXPECT_THROW(parse_mirror_choice(text), Error) << text;
}

TEST(MirrorChoiceTest, NodesStandForAllThatHangsOnThem) {
  Scene scene = with_door();
  scene.name = "house.glb";
  scene.materials.resize(3);
  scene.materials[2].roughness = 0.0f;
  scene.meshes[0].material = scene.meshes[1].material = 2;  // the leaf of the door, and the floor
  scene.mirrors = find_mirrors(scene);
  ASSERT_EQ(scene.mirrors.size(), 2u);
  const auto chosen = [&](const char* text) {
    return choose_mirrors(parse_mirror_choice(text), scene);
  };
  using Out = std::vector<bool>;
  EXPECT_EQ(chosen("auto").left_out, Out());
  EXPECT_EQ(chosen("leaf").left_out, (Out{false, true}));
  EXPECT_EQ(chosen("frame").left_out, (Out{false, true}));
  EXPECT_EQ(chosen("-door").left_out, (Out{true, false}));
  EXPECT_EQ(chosen("house").left_out, (Out{false, false}));
  EXPECT_EQ(chosen("house; -frame").left_out, (Out{true, false}));
  EXPECT_EQ(chosen("house").missing, "");
  EXPECT_EQ(chosen("lake").left_out, (Out{true, true}));
  EXPECT_EQ(chosen("lake").missing,
            "The scene 'house.glb' has no mirror 'lake'; it has 'leaf', 'floor'.");
}

using NodeFileTest = SceneFile;

TEST_F(NodeFileTest, NodesAreThoseOfTheFile) {
  json file = triangle_file();
  file["nodes"] = json::array({{{"name", "hinge"}, {"translation", {2, 0, 0}}, {"children", {1}}},
                               {{"mesh", 0}, {"name", "thing"}, {"translation", {1, 0, 0}}}});
  const Scene scene = load_scene(write(file));
  ASSERT_EQ(scene.nodes.size(), 2u);
  EXPECT_EQ(scene.nodes[0].name, "hinge");
  EXPECT_EQ(scene.nodes[1].parent, 0);
  expect_near(Vec3f(Vec3(scene.nodes[1].to_world[3])), {3, 0, 0});
  EXPECT_EQ(scene.meshes[0].node, 1);
  Scene turned = scene;
  pose_scene({"hinge turn=0,90,0"}, turned);
  expect_near(turned.meshes[0].positions[0], {2, 0, -1});
}

}  // namespace
}  // namespace polyhull
