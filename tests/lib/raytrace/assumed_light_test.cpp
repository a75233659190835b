// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes without light, in which nothing may be taken for granted, and the sky that is assumed.
#include "scene/assumed_light.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <numbers>

#include "builtin/shapes.h"
#include "raytrace/light_cache.h"
#include "raytrace/path_tracer.h"
#include "scene/gltf_lights.h"
#include "view/background.h"

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;

Scene floor_scene(float albedo = 0.5f) {
  Scene scene;
  scene.name = "test:floor";
  scene.materials.resize(1);
  scene.materials[0].base_colour = Vec3f(albedo);
  scene.meshes = {parallelogram("floor", 0, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6})};
  return scene;
}

/// Half floor, half of what lies beyond.
const Camera camera = look_at({0, 1.5, 0}, {0, 0.4, -3}, 60, 24, 32);

BackgroundOptions settings(bool progressive, ViewMethod method) {
  BackgroundOptions options;
  options.light.spacing = 0.1f;
  options.light.bounce_spacing = 0.4f;
  options.progressive = progressive;
  options.method = method;
  return options;
}

/// Once the light is exact.
std::vector<Vec3f> picture_of(const Scene& scene, bool progressive, ViewMethod method) {
  Background background(scene, settings(progressive, method));
  for (int i = 0; i < 5000 && !background.light_is_exact(); ++i) {
    background.update(camera, scene.lights, scene.exposure);
    if (progressive) usleep(1000);
  }
  EXPECT_TRUE(background.light_is_exact());
  EXPECT_FALSE(background.announcement().ambient.x < 0.0f);
  return background.picture();
}

TEST(SceneWithoutLight, IsDarkAndNoMore) {
  const Scene plain = floor_scene();
  Scene off = plain, both_sides = plain, mirrors = plain, vertices = plain, points = plain;
  off.lights.resize(1);
  off.lights[0].centre = {0, 2, 0};
  both_sides.materials[0].double_sided = true;
  mirrors.materials[0].roughness = 0.0f;
  mirrors.mirrors = find_mirrors(mirrors);
  vertices.meshes[0].triangles.clear();
  std::fill(points.meshes[0].positions.begin(), points.meshes[0].positions.end(), Vec3f(0, 0, -2));
  for (const Scene& scene : {plain, off, both_sides, mirrors, vertices, points})
    for (const bool progressive : {false, true})
      for (const ViewMethod method : {ViewMethod::raster, ViewMethod::rays})
        for (const Vec3f& value : picture_of(scene, progressive, method))
          EXPECT_EQ(value, Vec3f(0.0f));
}

TEST(AssumedLight, ShowsAWhiteFloorAsAutomaticExposureSays) {
  Scene scene = floor_scene(1.0f);
  EXPECT_EQ(automatic_exposure(scene), 1.0f);
  assume_light(scene);
  ASSERT_EQ(scene.lights.size(), 1u);
  const Vec3f to_sun = glm::normalize(scene.lights[0].centre);
  EXPECT_GT(to_sun.x, 0.2f);
  EXPECT_GT(to_sun.y, 0.6f);
  EXPECT_GT(to_sun.z, 0.2f);
  const TracedScene traced(scene);
  const LightCache light(traced, settings(false, ViewMethod::raster).light);
  Ray down;
  down.origin = {0.3f, 1.0f, 0.2f};
  down.direction = {0, -1, 0};
  // The sky's even radiance from half of all directions, and the sun by its height.
  const float expected = pi * scene.sky.x + 2.0f * to_sun.y;
  EXPECT_NEAR(light.irradiance(traced.caster().intersect(down), false).x, expected, 0.01f);
  EXPECT_NEAR(light.mean_bounced().x, pi * scene.sky.x, 1e-4f);
  for (const ViewMethod method : {ViewMethod::raster, ViewMethod::rays}) {
    const std::vector<Vec3f> picture = picture_of(scene, false, method);
    EXPECT_NEAR(picture.back().x, 0.6f, 0.01f);
    EXPECT_NEAR(picture.front().x, scene.exposure * scene.sky.x, 1e-6f) << "the sky is seen";
    EXPECT_NEAR(picture.front().x, 0.23f, 0.15f);
  }
}

TEST(AssumedLight, IsThePathTracersLight) {
  Scene scene = floor_scene();
  scene.materials.resize(3);
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  scene.meshes.push_back(box("box", 0, {-0.9f, 0, -2.6f}, {-0.2f, 0.7f, -1.9f}));
  scene.meshes.push_back(sphere("ball", 1, {0.6f, 0.4f, -2.2f}, 0.4f, 24));
  scene.meshes.push_back(parallelogram("mirror", 1, {-1.5f, 0, -3}, {3, 0, 0}, {0, 0.8f, 0}));
  scene.mirrors = find_mirrors(scene);
  assume_light(scene);
  std::vector<Vec3f> truth(24 * 32, Vec3f(0.0f));
  trace_paths(TracedScene(scene), camera, 0, 64, {.light_samples = 4, .bounce_samples = 8}, truth);
  for (const ViewMethod method : {ViewMethod::raster, ViewMethod::rays}) {
    const std::vector<Vec3f> picture = picture_of(scene, false, method);
    double off = 0.0;
    for (std::size_t i = 0; i < picture.size(); ++i)
      off += glm::length(picture[i] - truth[i] / 64.0f) / std::sqrt(3.0);
    EXPECT_LT(off / (24 * 32), 0.008) << "method " << static_cast<int>(method);
  }
}

TEST(AssumedLight, BecomesBrighterWithoutANewLight) {
  Scene scene = floor_scene();
  assume_light(scene);
  Background background(scene, settings(false, ViewMethod::raster));
  const auto drawn = [&](float factor) {
    std::vector<Light> lights = scene.lights;
    lights[0].radiance *= factor;
    const auto work = background.update(camera, lights, 0.1f, factor);
    EXPECT_EQ(background.announcement().sky, factor * scene.sky);
    return std::pair{work, background.picture()};
  };
  const auto first = drawn(1.0f), second = drawn(2.0f), none = drawn(0.0f), again = drawn(1.0f);
  EXPECT_EQ(first.first, Background::Work::lit);
  for (const auto& other : {second, none, again}) EXPECT_EQ(other.first, Background::Work::drawn);
  EXPECT_EQ(again.second, first.second);
  for (std::size_t i = 0; i < first.second.size(); ++i) {
    EXPECT_NEAR(second.second[i].x, 2.0f * first.second[i].x, 1e-5f);
    EXPECT_EQ(none.second[i], Vec3f(0.0f));
  }
  // Where the sky alone is another, what the sun gives more is added: the picture of a new light.
  EXPECT_EQ(background.update(camera, scene.lights, 0.1f, 0.5f), Background::Work::drawn);
  EXPECT_EQ(background.update(camera, scene.lights, 0.1f, 0.5f), Background::Work::none);
  Background anew(scene, settings(false, ViewMethod::raster));
  EXPECT_EQ(anew.update(camera, scene.lights, 0.1f, 0.5f), Background::Work::lit);
  for (std::size_t i = 0; i < first.second.size(); ++i)
    EXPECT_LT(glm::length(background.picture()[i] - anew.picture()[i]), 1e-4f);
}

}  // namespace
}  // namespace polyhull
