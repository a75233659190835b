// SPDX-License-Identifier: LGPL-2.1-or-later
// The scene that ships with a door, a second lamp and a mirror.
#include <gtest/gtest.h>

#include <string>

#include "base/error.h"
#include "builtin/room.h"
#include "raytrace/ray_caster.h"
#include "scene/changes/scene_changes.h"
#include "scene/scene.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

/// The mesh that a ray from the room's middle meets on its way through the doorway.
std::string through_the_doorway(const Scene& scene) {
  RayCaster caster;
  for (const SceneMesh& mesh : scene.meshes) caster.add_mesh(mesh.positions, mesh.triangles);
  caster.commit();
  Ray ray;
  ray.origin = {0, 1.2f, 0};
  ray.direction = {-1, 0, 0};
  const RayHit hit = caster.intersect(ray);
  return hit.hit() ? scene.meshes[hit.mesh].name : "nothing";
}

TEST(Apartment, TheDoorOpensAndThereIsACorridor) {
  Scene scene = open_scene("builtin:apartment");
  EXPECT_EQ(through_the_doorway(scene), "door");
  EXPECT_EQ(pose_scene({.nodes = "door turn=0,105,0"}, scene), "");
  EXPECT_EQ(through_the_doorway(scene), "corridor wall");
}

TEST(Apartment, EachLampIsTheMeshThatShowsIt) {
  const Scene scene = open_scene("builtin:apartment");
  ASSERT_EQ(scene.lights.size(), 2u);
  for (const Light& light : scene.lights) {
    ASSERT_GE(light.mesh, 0);
    const SceneMesh& mesh = scene.meshes[static_cast<std::size_t>(light.mesh)];
    EXPECT_EQ(mesh.name, light.name);
    EXPECT_EQ(mesh.node, light.node);
    EXPECT_EQ(scene.materials[static_cast<std::size_t>(mesh.material)].emission, light.radiance);
  }
}

TEST(Apartment, ItsMirrorsAreTheFloorAndTheGlass) {
  const Scene scene = open_scene("builtin:apartment");
  ASSERT_EQ(scene.mirrors.size(), 2u);
  for (const Mirror& mirror : scene.mirrors) {
    const bool floor = scene.meshes[static_cast<std::size_t>(mirror.meshes[0])].name == "floor";
    EXPECT_GT(floor ? mirror.normal.y : mirror.normal.z, 0.99f);
  }
}

TEST(Apartment, OtherNamesOfTheKindAreRefused) {
  EXPECT_TRUE(is_builtin_scene(""));
  EXPECT_FALSE(is_builtin_scene("room.glb"));
  test::expect_refused([&] { open_scene("builtin:rom"); }, "builtin:apartment");
}

}  // namespace
}  // namespace polyhull
