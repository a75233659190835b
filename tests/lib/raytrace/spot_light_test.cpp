// SPDX-License-Identifier: LGPL-2.1-or-later
// A spot's cone: the extension's numbers, and the same light from the formula, the path tracer and the
// light cache.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "builtin/shapes.h"
#include "raytrace/area_light.h"
#include "raytrace/light_cache.h"
#include "raytrace/path_tracer.h"
#include "render/light_samples.h"
#include "scene/spot_cone.h"

namespace polyhull {
namespace {

constexpr float degree = std::numbers::pi_v<float> / 180.0f;

/// Of 30 W/sr, above the origin, downwards.
Light spot(float inner, float outer, float side = 0.002f) {
  Light light;
  light.centre = {0, 2, 0};
  light.u = {0.5f * side, 0, 0};
  light.v = {0, 0, 0.5f * side};
  light.radiance = Vec3f(30.0f / (side * side));
  light.inner_cone = inner * degree;
  light.outer_cone = outer * degree;
  return light;
}

Scene floor_under(const Light& light) {
  Scene scene;
  scene.materials.resize(1);
  scene.materials[0].base_colour = Vec3f(0.5f);
  scene.meshes = {parallelogram("floor", 0, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6})};
  scene.lights = {light};
  return scene;
}

/// KHR_lights_punctual's example code, word by word.
double attenuation(double angle, double inner, double outer) {
  const double scale = 1.0 / std::max(0.001, std::cos(inner) - std::cos(outer));
  const double offset = -std::cos(outer) * scale;
  double angular = std::clamp(std::cos(angle) * scale + offset, 0.0, 1.0);
  angular *= angular;
  return angular;
}

TEST(SpotLight, HasTheExtensionsIntensityInEveryDirection) {
  const Light light = spot(15, 25);
  EXPECT_TRUE(light.is_spot());
  for (const float angle : {0.0f, 10.0f, 14.9f, 17.0f, 20.0f, 24.0f, 25.1f, 40.0f, 80.0f}) {
    const float expected =
        static_cast<float>(attenuation(angle * degree, 15 * degree, 25 * degree));
    EXPECT_NEAR(cone_of(light).at(std::cos(angle * degree)), expected, 1e-5f) << angle;
    EXPECT_NEAR(light_exit(light, std::cos(angle * degree)), expected, 1e-5f) << angle;
    // On a surface that faces it, 3 m away.
    const Vec3f way(std::sin(angle * degree), -std::cos(angle * degree), 0.0f);
    const LightSample sample = sample_light(light, {0.5f, 0.5f}, light.centre + 3.0f * way, -way);
    EXPECT_NEAR(sample.weight * light.radiance.x, 30.0f * expected / 9.0f, 1e-4f) << angle;
    EXPECT_NEAR(sample.whole * light.radiance.x, 30.0f / 9.0f, 1e-4f) << angle;
    EXPECT_EQ(expected == 1.0f, angle < 15.0f) << angle;
    EXPECT_EQ(sample.weight == 0.0f, angle > 25.0f) << angle;
  }
  EXPECT_EQ(sample_light(light, {0.5f, 0.5f}, {0.1f, 3, 0}, {0, -1, 0}).whole, 0.0f) << "behind";
}

TEST(SpotLight, OthersHaveNoCone) {
  Light light = spot(0, 0);
  EXPECT_FALSE(light.is_spot());
  EXPECT_EQ(cone_of(light).at(0.3f), 1.0f);
  EXPECT_EQ(light_exit(light, 0.3f), 0.3f);
  const LightSample sample = sample_light(light, {0.5f, 0.5f}, {1, 0, 0}, {0, 1, 0});
  EXPECT_EQ(sample.weight, sample.whole);
  light = spot(10, 20);
  light.u = light.v = Vec3f(0.0f);
  EXPECT_FALSE(light.is_spot()) << "a point has no axis";
}

TEST(SpotLight, TheSubjectsLightIsThatWhoseConeHasIt) {
  std::vector<Light> lights = {spot(15, 25), spot(15, 25)};
  lights[1].centre.x = 4.0f;
  lights[1].radiance *= 100.0f;
  const auto given = [&](std::size_t i, double x) { return light_given(lights[i], {x, 0, 0}); };
  EXPECT_GT(given(0, 0.2), 0.0);
  EXPECT_EQ(given(1, 0.2), 0.0);
  EXPECT_EQ(given(0, 3.8), 0.0);
  EXPECT_GT(given(1, 3.8), 0.0);
  EXPECT_EQ(given(0, 1.9) + given(1, 1.9), 0.0) << "outside of both";
}

/// The floor's irradiance at \p place, from the middle of each of parts^2 of the light.
float irradiance_at(const Light& light, const Vec3f& place, int parts) {
  double sum = 0.0;
  for (int j = 0; j < parts; ++j)
    for (int i = 0; i < parts; ++i)
      sum += sample_light(light, {(i + 0.5f) / parts, (j + 0.5f) / parts}, place, {0, 1, 0}).weight;
  return static_cast<float>(sum / (parts * parts)) * light.radiance.x;
}

class SpotOnAFloor : public testing::TestWithParam<std::tuple<float, float, float>> {};

TEST_P(SpotOnAFloor, IsTheSameTracedAndKept) {
  const auto [inner, outer, side] = GetParam();
  const Scene scene = floor_under(spot(inner, outer, side));
  const TracedScene traced(scene);
  const LightCache cache(traced);
  const Camera camera = look_at({0, 5, 0.01}, {0, 0, 0}, 45, 24, 24);
  std::vector<Vec3f> sums(24 * 24, Vec3f(0.0f));
  trace_paths(traced, camera, 0, 64, {.light_samples = 4}, sums);
  float most = 0.0f;
  double traced_off = 0.0, kept_off = 0.0;
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 24; ++x) {
      const Vec3 way = camera.ray({static_cast<double>(x), static_cast<double>(y)});
      const Vec3f place(camera.centre() - way * camera.centre().y / way.y);
      const float expected = irradiance_at(scene.lights[0], place, 40);
      most = std::max(most, expected);
      Ray ray;
      ray.origin = place + Vec3f(0, 0.1f, 0);
      ray.direction = {0, -1, 0};
      const Vec3f kept = cache.irradiance(traced.caster().intersect(ray), false);
      kept_off += std::abs(kept.x - expected);
      // A pixel is some 17 cm wide: its mean, not its middle.
      float mean = 0.0f;
      for (int k = 0; k < 64; ++k) {
        const Vec3 to = camera.ray({x + (k % 8 - 3.5) / 8, y + (k / 8 - 3.5) / 8});
        mean += irradiance_at(scene.lights[0],
                              Vec3f(camera.centre() - to * camera.centre().y / to.y), 5) /
                64.0f;
      }
      traced_off += std::abs(sums[y * 24 + x].x / 64.0f - mean * 0.5f / std::numbers::pi_v<float>);
    }
  }
  EXPECT_NEAR(most, 30.0f / 4.0f, 0.3f);
  EXPECT_LT(traced_off / (24 * 24), 0.002 * most * 0.5 / std::numbers::pi);
  EXPECT_LT(kept_off / (24 * 24), 0.002 * most);
  EXPECT_EQ(cache.irradiance({.distance = 1, .mesh = 0, .triangle = 0, .u = 0, .v = 0}, false),
            Vec3f(0.0f))
      << "the floor's corner is dark";
}

INSTANTIATE_TEST_SUITE_P(Cones, SpotOnAFloor,
                         testing::Values(std::tuple{20.0f, 25.0f, 0.2f},
                                         std::tuple{0.0f, 45.0f, 0.2f},
                                         std::tuple{30.0f, 30.0f, 0.2f},
                                         std::tuple{30.0f, 30.0f, 0.01f}));

// A mirror on the floor throws the cone at the ceiling.
TEST(SpotLight, ConesAreMirrored) {
  Scene scene = floor_under(spot(10, 15, 0.05f));
  scene.materials[0].roughness = 0.0f;
  scene.materials[0].metallic = 1.0f;
  scene.materials[0].base_colour = Vec3f(1.0f);
  scene.materials.resize(2);
  scene.meshes.push_back(parallelogram("ceiling", 1, {-3, 3, -3}, {6, 0, 0}, {0, 0, 6}));
  scene.mirrors = find_mirrors(scene);
  const TracedScene traced(scene);
  ASSERT_EQ(traced.mirrored_lights().size(), 1u);
  const LightCache cache(traced);
  const auto at = [&](float x) {
    Ray ray;
    ray.origin = {x, 2.9f, 0};
    ray.direction = {0, 1, 0};
    return cache.irradiance(traced.caster().intersect(ray), false).x;
  };
  // The image is 5 m below the ceiling.
  const auto expected = [](double x) {
    const double angle = std::atan(x / 5.0), d = std::hypot(x, 5.0);
    return 30.0 * attenuation(angle, 10 * degree, 15 * degree) * std::cos(angle) / (d * d);
  };
  for (const float x : {0.0f, 0.5f, 1.0f, 1.2f})
    EXPECT_NEAR(at(x), expected(x), 0.03 * expected(0)) << x;
  EXPECT_EQ(at(1.6f), 0.0f);
}

}  // namespace
}  // namespace polyhull
