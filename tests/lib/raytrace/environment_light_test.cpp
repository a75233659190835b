// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes that are lit by what is around them, of which the path tracer is the truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "builtin/shapes.h"
#include "environment/environment.h"
#include "environment_picture.h"
#include "raytrace/light_cache.h"
#include "raytrace/path_tracer.h"
#include "raytrace/sampling.h"
#include "scene/assumed_light.h"
#include "view/background.h"

namespace polyhull {
namespace {

using test::even_environment;
using test::outdoors;

constexpr float pi = std::numbers::pi_v<float>;

std::shared_ptr<const Environment> made(const RadiancePicture& picture) {
  return std::make_shared<const Environment>(picture, 20.0, "test");
}

Scene lit(std::vector<SceneMesh> meshes, const RadiancePicture& picture) {
  Scene scene;
  scene.name = "test:environment";
  scene.materials.resize(2);
  scene.materials[0].base_colour = {0.7f, 0.6f, 0.5f};
  scene.materials[1].base_colour = Vec3f(0.9f);
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  scene.meshes = std::move(meshes);
  scene.mirrors = find_mirrors(scene);
  scene.exposure = 0.5f;
  scene.exposure_given = true;
  set_environment(made(picture), scene);
  return scene;
}

SceneMesh standing_box() {
  return box("box", 0, {-0.3f, 0.001f, -0.3f}, {0.3f, 0.6f, 0.3f});
}
SceneMesh wide_floor() {
  return parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4});
}

LightCacheOptions options() {
  LightCacheOptions out;
  out.spacing = 0.05f;
  out.bounce_spacing = 0.25f;
  return out;
}

const Camera camera = look_at({1.2, 1.4, 2.0}, {0, 0.3, 0}, 55, 64, 48);

/// The mean and the root mean square of the difference of two pictures, all channels together.
struct Difference {
  double mean = 0.0, rms = 0.0;
};
Difference difference(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  Difference out;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3 d(a[i] - b[i]);
    out.mean += (d.x + d.y + d.z) / 3.0;
    out.rms += glm::dot(d, d) / 3.0;
  }
  out.mean /= static_cast<double>(a.size());
  out.rms = std::sqrt(out.rms / static_cast<double>(a.size()));
  return out;
}

std::vector<Vec3f> truth(const Scene& scene, std::uint32_t samples, const Camera& seen = camera) {
  const TracedScene traced(scene);
  std::vector<Vec3f> sums(
      static_cast<std::size_t>(seen.width) * static_cast<std::size_t>(seen.height), Vec3f(0.0f));
  PathOptions paths;
  paths.light_samples = 4;
  paths.bounce_samples = 4;
  trace_paths(traced, seen, 0, samples, paths, sums);
  for (Vec3f& sum : sums) sum /= static_cast<float>(samples);
  return sums;
}

// What is convex hides nothing from itself: its irradiance under an even light L is pi L, everywhere.
TEST(EnvironmentLightTest, AConvexBodyIsLitEvenly) {
  const Vec3f colour(0.8f, 0.5f, 0.2f);
  const Scene scene = lit({standing_box()}, even_environment(colour));
  const TracedScene traced(scene);
  const LightCache light(traced, options());
  int asked = 0;
  for (std::uint32_t i = 0; i < scene.meshes[0].triangles.size() / 3; ++i)
    for (const Vec2f& at : {Vec2f(0.2f, 0.3f), Vec2f(0.6f, 0.1f), Vec2f(0.05f, 0.05f)}) {
      RayHit hit;
      hit.mesh = 0;
      hit.triangle = i;
      hit.u = at.x;
      hit.v = at.y;
      const Vec3f found = light.irradiance(hit, false) / (pi * colour);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], 1.0f, 1.2e-3f);
      ++asked;
    }
  EXPECT_GT(asked, 20);
  // And so it looks: white times what it scatters, before what is around it.
  const std::vector<Vec3f> picture = truth(scene, 64);
  for (const Vec3f& value : picture) {
    const Vec3f body = 0.5f * colour * scene.materials[0].base_colour, around = 0.5f * colour;
    const Vec3f share = (around - value) / (around - body);
    EXPECT_NEAR(share.x, share.y, 0.15f);  // between these two
    EXPECT_GT(share.x, -0.05f);
    EXPECT_LT(share.x, 1.15f);
  }
}

// Straight light by importance is that of directions drawn evenly, where something is in the way, too.
TEST(EnvironmentLightTest, ImportanceSamplingIsUnbiased) {
  const Scene scene = lit({standing_box(), wide_floor()}, outdoors(64));
  const TracedScene traced(scene);
  for (const Vec3f& place : {Vec3f(0.32f, 0, 0), Vec3f(-0.5f, 0, 0.4f), Vec3f(0, 0, -0.7f)}) {
    const Vec3f origin = place + Vec3f(0, 1e-4f, 0), normal(0, 1, 0);
    Vec3 by_importance(0.0), evenly(0.0);
    constexpr std::uint32_t count = 1u << 14, even_count = 1u << 19;
    for (std::uint32_t i = 0; i < count; ++i)
      by_importance +=
          Vec3(environment_sample(traced, sample_point(i, 3u), origin, normal)) / double(count);
    for (std::uint32_t i = 0; i < even_count; ++i) {
      const Vec2f square = sample_point(i, 4u);
      const float up = square.x, flat = std::sqrt(1.0f - up * up), angle = 2.0f * pi * square.y;
      Ray ray;
      ray.origin = origin;
      ray.direction = {flat * std::cos(angle), up, flat * std::sin(angle)};
      // The picture's pixels, as areas: the bilinear picture has the same mean.
      if (!traced.caster().occluded(ray))
        evenly += Vec3(traced.sky(ray.direction)) * (2.0 * pi * up / double(even_count));
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(by_importance[k], evenly[k], 0.015 * evenly[k]);
  }
}

// The light that is kept makes the path tracer's picture, by both ways of drawing.
TEST(EnvironmentLightTest, BackgroundsComeCloseToTheTruth) {
  const Scene scene = lit({standing_box(), wide_floor()}, outdoors(64));
  const std::vector<Vec3f> exact = truth(scene, 64);
  for (const ViewMethod method : {ViewMethod::raster, ViewMethod::rays}) {
    BackgroundOptions background_options;
    background_options.light = options();
    background_options.method = method;
    Background background(scene, background_options);
    background.update(camera, {}, scene.exposure);
    const Difference found = difference(background.picture(), exact);
    RecordProperty("rms", std::to_string(found.rms));
    EXPECT_LT(std::abs(found.mean), 0.004) << static_cast<int>(method);
    EXPECT_LT(found.rms, 0.035) << static_cast<int>(method);
    // A quarter as bright is a quarter of the light, without its being computed anew.
    EXPECT_EQ(background.update(camera, {}, scene.exposure, 0.25f), Background::Work::drawn);
    Scene dim = scene;
    Background other(dim, background_options);
    other.update(camera, {}, scene.exposure, 0.25f);
    EXPECT_LT(difference(background.picture(), other.picture()).rms, 1e-5);
  }
}

// By way of a mirror the sun falls on the floor, blurred in the light that is kept, but no less.
TEST(EnvironmentLightTest, MirrorsThrowIt) {
  const SceneMesh mirror = parallelogram("mirror", 1, {-1.5f, 0, -1}, {3, 0, 0}, {0, 1.5f, 0});
  const Scene scene = lit({standing_box(), wide_floor(), mirror}, outdoors(64));
  const Camera above = look_at({0, 3.5, 0.01}, {0, 0, 0}, 60, 48, 48);
  const std::vector<Vec3f> exact = truth(scene, 32, above);
  BackgroundOptions background_options;
  background_options.light = options();
  Background background(scene, background_options);
  background.update(above, {}, scene.exposure);
  const Difference found = difference(background.picture(), exact);
  EXPECT_LT(std::abs(found.mean), 0.012);
  EXPECT_LT(found.rms, 0.09);
  const std::vector<Vec3f> without =
      truth(lit({standing_box(), wide_floor()}, outdoors(64)), 32, above);
  EXPECT_GT(difference(exact, without).mean, 0.006);
}

// Where nothing is, all see the picture: directly and in a mirror.
TEST(EnvironmentLightTest, WhatIsAroundIsSeen) {
  const SceneMesh mirror = parallelogram("mirror", 1, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4});
  const Scene scene = lit({mirror}, outdoors(64));
  const Camera seen = look_at({0, 1, 0}, {-3, 0.8, 0}, 70, 32, 32);
  const TracedScene traced(scene);
  Background background(scene, {});
  background.update(seen, {}, scene.exposure);
  const float f0 = 0.9f;
  int direct = 0, mirrored = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      Vec3f way = glm::normalize(Vec3f(seen.ray(Vec2(x, y))));
      Vec3f share(1.0f);
      Ray ray;
      ray.origin = Vec3f(seen.centre());
      // Of a whole pixel.
      bool all = true, any = false;
      for (const Vec2& corner : {Vec2(-1, -1), Vec2(1, -1), Vec2(-1, 1), Vec2(1, 1)}) {
        ray.direction = Vec3f(seen.ray(Vec2(x, y) + corner));
        const bool hit = traced.caster().occluded(ray);
        all = all && hit;
        any = any || hit;
      }
      if (all != any) continue;
      if (all) {
        share = fresnel(Vec3f(f0), -way.y);
        way.y = -way.y;
      }
      (all ? mirrored : direct) += 1;
      const Vec3f expected = share * glm::min(0.5f * scene.environment->radiance(way), Vec3f(1.0f));
      const Vec3f found = background.picture()[static_cast<std::size_t>(y * 32 + x)];
      EXPECT_LT(glm::length(found - expected), 2e-3f) << x << " " << y;
    }
  EXPECT_GT(direct, 100);
  EXPECT_GT(mirrored, 100);
}

// What stands for the environment in composites gives a floor that sees all of it what the picture does.
TEST(EnvironmentLightTest, ItsLightsGiveWhatItDoes) {
  const Scene scene = lit({standing_box(), wide_floor()}, outdoors(64));
  const TracedScene traced(lit({box("far", 0, {-9, -9, -9}, {-8.9f, -8.9f, -8.9f})}, outdoors(64)));
  for (const std::size_t count : {8u, 16u, 32u}) {
    const std::vector<Light> lights = environment_lights(scene, count);
    ASSERT_EQ(lights.size(), count);
    for (const Vec3f& normal : {Vec3f(0, 1, 0), Vec3f(0.6f, 0.8f, 0), Vec3f(0, 0.6f, -0.8f)}) {
      Vec3 sum(0.0);
      constexpr std::uint32_t ways = 256;
      for (const Light& light : lights)
        for (std::uint32_t i = 0; i < ways; ++i)
          sum += Vec3(light_sample(traced, light, sample_point(i, 9u), Vec3f(0, 0.3f, 0), normal)) /
                 double(ways);
      const Vec3f exact = scene.environment->irradiance(normal);
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(sum[k], exact[k], (count == 8 ? 0.08 : 0.05) * exact[k]) << count;
    }
  }
}

}  // namespace
}  // namespace polyhull
