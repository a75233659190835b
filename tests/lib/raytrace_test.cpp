// SPDX-License-Identifier: LGPL-2.1-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "builtin/room.h"
#include "builtin/shapes.h"
#include "raytrace/area_light.h"
#include "raytrace/filtered_texture.h"
#include "raytrace/light_cache.h"
#include "raytrace/path_tracer.h"
#include "raytrace/sampling.h"
#include "raytrace/surface_grid.h"
#include "support/picture_error.h"

namespace polyhull {
namespace {

using synthetic::rms;

constexpr double pi = std::numbers::pi;

Light ceiling_lamp(float height, float half_x, float half_z) {
  Light light;
  light.centre = {0, height, 0};
  light.u = {half_x, 0, 0};
  light.v = {0, 0, half_z};
  light.radiance = Vec3f(1.0f);
  return light;
}

Material diffuse(const Vec3f& colour) {
  Material material;
  material.base_colour = colour;
  return material;
}

/// Mean picture values of each pixel.
std::vector<Vec3f> traced(const TracedScene& scene, const Camera& camera, std::uint32_t samples,
                          PathOptions options = {}) {
  std::vector<Vec3f> sums(static_cast<std::size_t>(camera.width) * camera.height, Vec3f(0.0f));
  trace_paths(scene, camera, 0, samples, options, sums);
  for (Vec3f& sum : sums) sum /= static_cast<float>(samples);
  return sums;
}

TEST(AreaLight, CentredRectangleOverAPointAsInTextbooks) {
  // Form factor of a point to a parallel rectangle a x b at height c, the point below one corner:
  // F = 1/(2 pi) [A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + B/sqrt(1+B^2) atan(A/sqrt(1+B^2))], A=a/c,
  // B=b/c (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-4); four of them
  // here.
  for (const auto& [height, x, z] :
       {std::array{2.0, 0.5, 0.7}, {0.1, 3.0, 1.0}, {30.0, 0.2, 0.1}}) {
    const double a = x / height, b = z / height;
    const double corner = (a / std::hypot(1, a) * std::atan(b / std::hypot(1, a)) +
                           b / std::hypot(1, b) * std::atan(a / std::hypot(1, b))) /
                          (2 * pi);
    const Light light =
        ceiling_lamp(static_cast<float>(height), static_cast<float>(x), static_cast<float>(z));
    EXPECT_NEAR(unoccluded_irradiance(light, Vec3f(0.0f), {0, 1, 0}), 4 * pi * corner,
                1e-5 * 4 * pi * corner + 1e-7);
    EXPECT_EQ(unoccluded_irradiance(light, Vec3f(0.0f), {0, -1, 0}), 0.0f);
    EXPECT_EQ(unoccluded_irradiance(light, {0, static_cast<float>(2 * height), 0}, {0, -1, 0}),
              0.0f)
        << "behind the light";
  }
}

TEST(AreaLight, FormulaIsTheMeanOfTheSamplesAlsoAcrossTheHorizon) {
  const Light light = ceiling_lamp(1.0f, 0.8f, 1.1f);
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3f n = glm::normalize(Vec3f(normal(random), normal(random), normal(random)));
    const Vec3f point(normal(random), -0.3f, normal(random));
    double mean = 0.0;
    constexpr int count = 1 << 14;
    for (std::uint32_t i = 0; i < count; ++i) {
      mean += sample_light(light, sample_point(i, 77), point, n).weight / count;
    }
    EXPECT_NEAR(unoccluded_irradiance(light, point, n), mean, 2e-3) << trial;
  }
}

TEST(Sampling, PointsAreStratified) {
  for (const std::uint32_t seed : {1u, 99u}) {
    // A (0, 4, 2)-net: each elementary box of area 1/16 holds one of 16 points.
    for (int log_width = 0; log_width <= 4; ++log_width) {
      std::array<int, 16> count{};
      const int columns = 1 << log_width, rows = 16 / columns;
      for (std::uint32_t i = 0; i < 16; ++i) {
        const Vec2f p = sample_point(i, seed);
        ASSERT_TRUE(p.x >= 0 && p.x < 1 && p.y >= 0 && p.y < 1);
        ++count[static_cast<int>(p.x * columns) + columns * static_cast<int>(p.y * rows)];
      }
      for (const int c : count) EXPECT_EQ(c, 1);
    }
  }
}

TEST(Tone, TablesAreEachOthersInverse) {
  for (int value = 0; value < 256; ++value) {
    EXPECT_EQ(linear_to_srgb(srgb_to_linear(static_cast<std::uint8_t>(value))), value);
  }
  EXPECT_EQ(linear_to_srgb(NAN), 0);
  EXPECT_EQ(linear_to_srgb(-1.0f), 0);
  EXPECT_EQ(linear_to_srgb(INFINITY), 255);
}

TEST(FilteredTexture, WideFootprintsGiveTheMean) {
  Picture checks{64, 64, 4, std::vector<std::uint8_t>(64 * 64 * 4, 255)};
  for (int i = 0; i < 64 * 64; ++i) {
    if ((i + i / 64) % 2) checks.pixels[4 * i] = 0;
  }
  const FilteredTexture texture(checks);
  EXPECT_NEAR(texture.over({0.3f, 0.3f}, {1.0f, 0.0f}, {0.0f, 1.0f}).x, 0.5f, 0.01f);
  EXPECT_NEAR(texture.over({0.3f, 0.3f}, {0.1f, 0.1f}, {0.0f, 1.0f}).x, 0.5f, 0.01f);
  EXPECT_NEAR(texture.at({0.5f / 64, 0.5f / 64}).x, 1.0f, 1e-3f);
  EXPECT_NEAR(texture.at({1.5f / 64 + 7, 0.5f / 64 - 3}).x, 0.0f, 1e-3f);
}

TEST(FilteredTexture, ScenesWithAPictureInCommonHaveItInCommon) {
  const Picture grey{8, 8, 4, std::vector<std::uint8_t>(8 * 8 * 4, 128)};
  Scene scene;
  scene.textures.emplace_back(grey);
  std::weak_ptr<const FilteredTexture> first;
  {
    const Scene copy = scene;
    const auto texture = filtered_texture(scene.textures[0]);
    EXPECT_EQ(filtered_texture(copy.textures[0]), texture);
    EXPECT_NE(filtered_texture(grey), texture) << "a picture of its own";
    first = texture;
  }
  EXPECT_TRUE(first.expired()) << "nobody has it any longer";
}

TEST(SurfaceGrid, TakesAsManyVerticesAsThereAreAndStops) {
  // Triangles smaller than a cell: larger cells save none of their vertices.
  constexpr std::uint32_t side = 60;
  Scene scene;
  scene.materials.push_back(diffuse(Vec3f(0.5f)));
  SceneMesh& mesh = scene.meshes.emplace_back();
  for (std::uint32_t j = 0; j <= side; ++j) {
    for (std::uint32_t i = 0; i <= side; ++i) {
      const float x = 0.01f * static_cast<float>(i), z = 0.01f * static_cast<float>(j);
      mesh.positions.emplace_back(x, 0.1f * x * x + 0.2f * z * z, z);
      mesh.normals.emplace_back(glm::normalize(Vec3f(-0.2f * x, 1.0f, -0.4f * z)));
    }
  }
  for (std::uint32_t j = 0; j < side; ++j) {
    for (std::uint32_t i = 0; i < side; ++i) {
      const std::uint32_t a = j * (side + 1) + i, b = a + 1, c = a + side + 1, d = c + 1;
      mesh.triangles.insert(mesh.triangles.end(), {a, c, b, b, c, d});
    }
  }
  const SurfaceGrid grid(scene, 0.5f, 100);
  EXPECT_EQ(grid.size(), mesh.positions.size());
  EXPECT_EQ(grid.spacing(), 0.5f);
}

TEST(PathTracer, FloorUnderALampIsTheClosedForm) {
  Scene scene;
  scene.materials = {diffuse({0.5f, 0.3f, 0.7f})};
  scene.meshes = {parallelogram("floor", 0, {-9, 0, 9}, {18, 0, 0}, {0, 0, -18})};
  scene.lights = {ceiling_lamp(2.0f, 0.5f, 0.5f)};
  scene.lights[0].radiance = Vec3f(3.0f);
  scene.exposure = 0.8f;
  const TracedScene traced_scene(scene);
  const Camera camera = look_at({0.5, 4, 3}, {0.5, 0, 0}, 40, 16, 12);
  const std::vector<Vec3f> picture = traced(traced_scene, camera, 256);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 direction = camera.ray({static_cast<double>(x), static_cast<double>(y)});
      const Vec3 point = camera.centre() - direction * camera.centre().y / direction.y;
      const Vec3f expected = scene.materials[0].base_colour *
                             unoccluded_irradiance(scene.lights[0], Vec3f(point), {0, 1, 0}) *
                             3.0f * 0.8f / static_cast<float>(pi);
      EXPECT_LT(glm::length(picture[y * camera.width + x] - expected),
                0.01f * glm::length(expected) + 5e-4f);
    }
  }
}

TEST(PathTracer, ClosedBoxOfEvenGlowGainsOneBounce) {
  // Every wall sends e and returns rho of what it gets: one bounce makes e (1 + rho), no more, no
  // less.
  Scene scene;
  scene.materials = {diffuse(Vec3f(0.6f))};
  scene.materials[0].emission = Vec3f(0.25f);
  scene.meshes = {box("furnace", 0, Vec3f(-1.0f), Vec3f(1.0f))};
  const TracedScene furnace(scene);
  const Camera camera = look_at({0.3, 0.2, 0.1}, {1, 0.5, 0.3}, 90, 16, 16);
  for (const Vec3f& value : traced(furnace, camera, 4)) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(value[k], 0.25f * 1.6f, 1e-5f);
  }
  // A mirror body of reflectance 1 inside is not to be seen.
  scene.materials.push_back(diffuse(Vec3f(1.0f)));
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  scene.meshes.push_back(sphere("chrome", 1, {0.7f, 0.4f, 0.2f}, 0.2f, 32));
  scene.meshes.push_back(box("mirror", 1, {0.5f, -0.4f, -0.6f}, {0.7f, -0.2f, -0.4f}));
  scene.mirrors = find_mirrors(scene);
  EXPECT_EQ(scene.mirrors.size(), 6u);
  const TracedScene with_mirrors(scene);
  for (const Vec3f& value : traced(with_mirrors, camera, 4)) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(value[k], 0.25f * 1.6f, 1e-5f);
  }
}

TEST(PathTracer, MirrorShowsTheMirroredWorld) {
  Scene scene;
  scene.materials = {diffuse({0.8f, 0.5f, 0.2f}), diffuse(Vec3f(1.0f))};
  scene.materials[0].emission = {0.5f, 0.3f, 0.1f};
  scene.materials[0].base_colour = Vec3f(0.0f);
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  Scene expected = scene;
  SceneMesh body = box("body", 0, {-0.5f, 0.2f, -0.4f}, {0.3f, 1.1f, 0.5f});
  scene.meshes = {body, parallelogram("mirror", 1, {-5, 0, 5}, {10, 0, 0}, {0, 0, -10})};
  scene.mirrors = find_mirrors(scene);
  expected.meshes = {body};
  for (Vec3f& p : body.positions) p.y = -p.y;
  expected.meshes.push_back(body);
  const Camera camera = look_at({2, 1.5, 3}, {0, 0, 0}, 50, 64, 48);
  // The same samples of the pixels: the pictures differ by rounding at edges only.
  const auto with_mirror = traced(TracedScene(scene), camera, 16);
  const auto without = traced(TracedScene(expected), camera, 16);
  EXPECT_LT(rms(with_mirror, without), 2e-3);
}

TEST(PathTracer, MirroredLampLightsAsItsImageDoes) {
  // A mirror floor under a lamp: the wall gets the lamp's light and its mirror image's.
  Scene scene;
  scene.materials = {diffuse(Vec3f(0.5f)), diffuse(Vec3f(1.0f))};
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  scene.meshes = {parallelogram("wall", 0, {-1, 0, 0}, {2, 0, 0}, {0, 2, 0}),
                  parallelogram("mirror", 1, {-9, 0, 9}, {18, 0, 0}, {0, 0, -9})};
  scene.lights = {ceiling_lamp(2.0f, 0.4f, 0.4f)};
  scene.lights[0].centre.z = 1.0f;
  scene.mirrors = find_mirrors(scene);
  const TracedScene traced_scene(scene);
  ASSERT_EQ(traced_scene.mirrored_lights().size(), 1u);
  const Camera camera = look_at({0, 1, 3}, {0, 1, 0}, 20, 8, 8);
  const std::vector<Vec3f> picture = traced(traced_scene, camera, 256);
  Light image = scene.lights[0];
  image.centre.y = -2.0f;
  std::swap(image.u, image.v);
  for (int y = 0; y < 8; ++y) {
    const Vec3 direction = camera.ray({3.5, static_cast<double>(y)});
    const Vec3f point(camera.centre() - direction * camera.centre().z / direction.z);
    const float expected = (unoccluded_irradiance(scene.lights[0], point, {0, 0, 1}) +
                            unoccluded_irradiance(image, point, {0, 0, 1})) *
                           0.5f / static_cast<float>(pi);
    EXPECT_NEAR(0.5f * (picture[8 * y + 3].x + picture[8 * y + 4].x), expected, 0.012f * expected);
  }
}

// A mirror of glass, in two tiles, gives back what Schlick says, by the angle at the mirror.
TEST(MirroredLight, FollowsSchlick) {
  Scene scene;
  scene.materials = {diffuse(Vec3f(0.5f))};
  scene.materials[0].roughness = 0.0f;
  scene.materials[0].ior = 1.5f;
  scene.meshes = {parallelogram("mirror", 0, {-9, 0, 9}, {10, 0, 0}, {0, 0, -18}),
                  parallelogram("mirror", 0, {1, 0, 9}, {8, 0, 0}, {0, 0, -18})};
  scene.lights = {ceiling_lamp(1.0f, 0.05f, 0.05f)};
  scene.lights[0].radiance = {3.0f, 2.0f, 1.0f};
  scene.mirrors = find_mirrors(scene);
  const TracedScene traced_scene(scene);
  ASSERT_EQ(traced_scene.mirrored_lights().size(), 1u);
  const MirroredLight& light = traced_scene.mirrored_lights()[0];
  for (const float x : {0.0f, 0.5f, 1.0f, 2.0f, 4.0f}) {
    const Vec3f point(x, 0.5f, 0.0f), normal(0, -1, 0);
    const Vec2f middle(0.5f);
    const LightSample sample = sample_light(light.image, middle, point, normal);
    // The image of the lamp's middle is as far below the mirror as the lamp is above it.
    EXPECT_LT(glm::length(sample.place - Vec3f(0, -1, 0)), 1e-5f);
    const float way = std::hypot(x, 1.5f), cosine = 1.5f / way;
    EXPECT_NEAR(sample.weight, 4 * 0.05f * 0.05f * cosine * cosine / (way * way),
                1e-3f * sample.weight);
    const float reflected = 0.04f + 0.96f * std::pow(1.0f - cosine, 5.0f);
    const Vec3f found = mirrored_light_sample(traced_scene, light, middle, point, normal);
    for (int c = 0; c < 3; ++c) {
      const float expected = sample.weight * reflected * scene.lights[0].radiance[c];
      EXPECT_NEAR(found[c], expected, 1e-3f * expected) << "x " << x;
    }
  }
}

TEST(PathTracer, SubjectShowsItsColourThrowsShadowAndIsMirrored) {
  Scene scene;
  scene.materials = {diffuse(Vec3f(0.5f))};
  scene.materials[0].roughness = 0.0f;
  scene.materials[0].ior = 2.0f;
  scene.meshes = {parallelogram("floor", 0, {-9, 0, 9}, {18, 0, 0}, {0, 0, -18})};
  scene.lights = {ceiling_lamp(3.0f, 0.2f, 0.2f)};
  scene.lights[0].radiance = Vec3f(60.0f);
  scene.exposure = 0.5f;
  scene.mirrors = find_mirrors(scene);
  TracedScene traced_scene(scene);
  const Camera camera = look_at({0, 1.2, 5}, {0, 0.2, 0}, 40, 64, 64);
  const std::vector<Vec3f> empty = traced(traced_scene, camera, 64);
  const SceneMesh body = box("subject", 0, {-0.4f, 0.5f, -0.4f}, {0.4f, 1.0f, 0.4f});
  const Vec3f red(0.7f, 0.1f, 0.05f);
  traced_scene.set_subjects({{body.positions, body.triangles,
                              [&](std::uint32_t, float, float, const Vec3f&) { return red; }}});
  const std::vector<Vec3f> with = traced(traced_scene, camera, 64);
  const auto at = [&](const std::vector<Vec3f>& picture, const Vec3& world) {
    const Vec2 p = *camera.project_ideal(world);
    return picture[static_cast<int>(std::lround(p.y)) * 64 + static_cast<int>(std::lround(p.x))];
  };
  EXPECT_LT(glm::length(at(with, {0, 0.75, 0.4}) - red), 1e-5f)
      << "as given, whatever the exposure";
  EXPECT_LT(at(with, {0, 0, 0.0}).y, 0.6f * at(empty, {0, 0, 0.0}).y) << "shadow";
  // In the mirror: F times its colour on top of the floor's own light.
  const Vec3f mirrored = at(with, {0, -0.75, 0.4}) - at(empty, {0, -0.75, 0.4});
  EXPECT_GT(mirrored.x, 0.05f);
  EXPECT_GT(mirrored.x, 3.0f * mirrored.y);
  traced_scene.set_subjects({});
  EXPECT_EQ(rms(traced(traced_scene, camera, 64), empty), 0.0);
}

TEST(PathTracer, SameOnOneThreadAndOnMany) {
  const TracedScene scene(room_scene());
  const Camera camera = look_at({1.2, 1.5, 2.4}, {0, 1, 0}, 55, 48, 27);
  PathOptions one;
  one.threads = 1;
  set_pool_threads(4);
  PathOptions many;
  many.threads = 4;
  EXPECT_EQ(traced(scene, camera, 2, one), traced(scene, camera, 2, many));
  set_pool_threads(0);
}

// A node at each vertex of a dense mesh, and yet not many more rays than a grid of the wanted size asks.
TEST(LightCache, DenseMeshesAskFewerWaysOfEachNode) {
  Scene scene;
  scene.materials.push_back(diffuse(Vec3f(0.8f)));
  scene.meshes = {sphere("ball", 0, {0, 1, 0}, 0.5f, 64),
                  parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4})};
  scene.lights = {ceiling_lamp(3.0f, 0.5f, 0.5f)};
  const TracedScene traced_scene(scene);
  LightCacheOptions options;
  options.spacing = 0.5f;
  options.bounce_spacing = 1.0f;
  options.first_samples = options.light_samples = 1;
  const LightCache enough(traced_scene, options);
  const std::size_t vertices = scene.meshes[0].positions.size();
  options.most_nodes = 8 * vertices / 4;
  const LightCache dense(traced_scene, options);
  EXPECT_LT(dense.rays(), enough.rays() / 3);
  // The light is the same but for noise.
  const Vec3f a = enough.mean_bounced(), b = dense.mean_bounced();
  EXPECT_GT(a.x, 0.0f);
  EXPECT_NEAR(b.x, a.x, 0.02f * a.x);
}

}  // namespace
}  // namespace polyhull
