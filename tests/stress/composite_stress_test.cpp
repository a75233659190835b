// SPDX-License-Identifier: LGPL-2.1-or-later
// Composites of what may come: eyes inside the subject, below the floor and in the mirror's plane,
// lamps inside the subject, meshes that are empty, flat or not finite, 1 to 64 cameras, sizes from one
// pixel on, all settings changed with every frame. Each is drawn as a fresh renderer draws it that
// skips nothing, and nothing is touched where nothing changes, or it is refused with a sentence.
// POLYHULL_STRESS=N makes N times as many.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "backend.h"
#include "base/error.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

using CompositeStress = testing::BackendTest;

int rounds(int once) {
  const char* times = std::getenv("POLYHULL_STRESS");
  return once * (times != nullptr ? std::max(1, std::atoi(times)) : 1);
}

class Chance {
 public:
  explicit Chance(unsigned seed) : random_(seed) {}
  int below(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  double from(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool once_in(int times) { return below(times) == 0; }
  template <class T>
  const T& of(const std::vector<T>& all) {
    return all[static_cast<std::size_t>(below(static_cast<int>(all.size())))];
  }
  float strange() {
    return of<float>({std::numeric_limits<float>::quiet_NaN(),
                      std::numeric_limits<float>::infinity(),
                      -std::numeric_limits<float>::infinity(), 1e38f, -1e38f, 1e-38f, 0.0f});
  }

 private:
  std::mt19937 random_;
};

/// A figure before \p count cameras.
synthetic::Photographed figure_before(int count) {
  const Hull hull = synthetic::figure(6);
  const std::vector<Camera> cameras = synthetic::ring(count, 3.2, 1.5, {0, 1, 0}, 48, 48, 45.0);
  synthetic::Photographed out = synthetic::photographed(hull, cameras);
  out.mesh.texturing = texture_hull(hull, cameras, {.metric = TextureMetric::camera_normal});
  return out;
}

/// A mesh that nobody should send.
Mesh odd_mesh(const Mesh& mesh, Chance& chance) {
  Mesh odd = mesh;
  std::vector<Vec3f>& vertices = odd.hull.vertices;
  switch (chance.below(6)) {
    case 0:
      odd.hull = Hull();
      break;
    case 1:  // flat
      for (Vec3f& v : vertices) v.y = 0.5f;
      break;
    case 2:  // one point
      for (Vec3f& v : vertices) v = Vec3f(0.1f);
      break;
    case 3:
      for (int i = 0; i < 3; ++i)
        vertices[static_cast<std::size_t>(chance.below(static_cast<int>(vertices.size())))]
                [chance.below(3)] = chance.strange();
      break;
    case 4:  // very far and large
      for (Vec3f& v : vertices) v = 1e4f * v;
      break;
    default:
      odd.texturing.reset();
  }
  return odd;
}

Camera any_viewport(Chance& chance, int width, int height) {
  const std::vector<Vec3> places = {{1.3, 1.5, 4.2},   {0.0, 1.0, 0.0},  // inside the subject
                                    {0.0, -2.0, 0.5},                    // below the floor
                                    {2.0, 0.0, 2.0},                     // in the mirror's plane
                                    {0.02, 1.95, 0.2}, {0.0, 9.0, 0.1},
                                    {0.3, 0.01, 1.0},  {-0.26, 1.2, 0.7}};
  const Vec3 eye = chance.of(places) + 1e-3 * chance.from(-1.0, 1.0);
  const Vec3 target(chance.from(-1, 1), chance.from(0, 2), chance.from(-3, 0));
  return synthetic::look_at(eye, target, width, height, chance.from(5.0, 140.0));
}

RenderSettings any_settings(Chance& chance) {
  RenderSettings settings;
  settings.shadow = chance.of<ShadowQuality>(
      {ShadowQuality::off, ShadowQuality::hard, ShadowQuality::fast, ShadowQuality::good});
  settings.mirror =
      chance.of<MirrorMode>({MirrorMode::off, MirrorMode::fresnel, MirrorMode::plain});
  settings.edge_samples = chance.of<int>({0, 1, 2, 4, 8});
  settings.soft_edges = chance.of<int>({0, 1}) == 1;
  settings.light_samples = chance.of<int>({1, 4});
  settings.shadow_map_size = chance.of<int>({16, 64});
  return settings;
}

Picture drawn(Renderer& renderer, const RenderFrame& frame, const RenderSettings& settings,
              Rectangle& changed) {
  Picture out{frame.width, frame.height, 4, {}};
  for (int i = 0; i < 4 * frame.width * frame.height; ++i)
    out.pixels.push_back(static_cast<std::uint8_t>(37 * i % 251));
  const Picture before = out;
  const RenderPlan plan = renderer.plan(frame, settings);
  changed = plan.changed();
  if (!plan.untouched())
    renderer.render(frame, plan, settings, before.pixels.data(), 4 * frame.width, out.pixels.data(),
                    4 * frame.width);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      const bool inside = x >= changed.x && y >= changed.y && x < changed.x + changed.width &&
                          y < changed.y + changed.height;
      const std::size_t at = 4 * (static_cast<std::size_t>(y) * frame.width + x);
      if (!inside) {
        EXPECT_TRUE(std::equal(&out.pixels[at], &out.pixels[at] + 4, &before.pixels[at]))
            << "pixel " << x << ", " << y << " beside what changes";
      }
    }
  }
  return out;
}

TEST_P(CompositeStress, WhateverComesIsDrawnAsIfItWereTheFirst) {
  Chance chance(12);
  const auto lasting = make_renderer();
  const auto scene = std::make_shared<const Scene>(synthetic::small_room(true));
  std::vector<synthetic::Photographed> figures;
  for (const int count : {1, 2, 4, 64}) figures.push_back(figure_before(count));
  int refused = 0;
  const int count = rounds(processor() ? 600 : 30);
  for (int round = 0; round < count; ++round) {
    RenderFrame frame;
    frame.width = chance.of<int>({1, 2, 7, 33, 64, 97});
    frame.height = chance.of<int>({1, 3, 16, 31, 48});
    frame.viewport = any_viewport(chance, frame.width, frame.height);
    frame.scene = chance.once_in(8) ? nullptr : scene;
    frame.lights = scene->lights;
    frame.exposure = scene->exposure;
    frame.ambient = Vec3f(0.3f);
    if (chance.once_in(4)) frame.lights[0].centre = Vec3f(chance.from(-0.2, 0.2), 1.0f, 0.0f);
    if (chance.once_in(6)) frame.lights[0].u = frame.lights[0].v = Vec3f(0.0f);
    if (chance.once_in(8)) frame.lights[0].centre[chance.below(3)] = chance.strange();
    if (chance.once_in(8)) frame.exposure = chance.strange();
    if (chance.once_in(12)) frame.viewport.K[0][0] = chance.strange();
    const Mesh& mesh = chance.of(figures).mesh;
    const Mesh odd = odd_mesh(mesh, chance);
    frame.subjects.push_back({chance.once_in(3) ? &odd : &mesh, {}, 0});
    if (chance.once_in(2))
      frame.subjects.back().lighting =
          chance.once_in(2) ? SubjectLighting::shade : SubjectLighting::relit;
    if (chance.once_in(3))
      frame.subjects.back().grade = {Vec3f(2.0f), Vec3f(chance.from(-1.0, 1.0)), Vec3f(0.1f), 4.0f};
    if (chance.once_in(3)) frame.subjects.push_back({&mesh, {}, 0});
    RenderSettings settings = any_settings(chance);
    Rectangle changed, all;
    try {
      const Picture picture = drawn(*lasting, frame, settings, changed);
      settings.skip = false;
      const auto fresh = make_renderer();
      EXPECT_EQ(drawn(*fresh, frame, settings, all).pixels, picture.pixels)
          << "round " << round << ", " << frame.width << "x" << frame.height;
    } catch (const Error& error) {
      ++refused;
      EXPECT_GT(std::string(error.what()).size(), 20u);
    }
  }
  EXPECT_LT(refused, count / 3);
}

// A picture as wide as elements take, and a scene of a million triangles.
TEST_P(CompositeStress, LargePicturesAndScenes) {
  const synthetic::Photographed figure = figure_before(2);
  Scene large = synthetic::small_room(true);
  SceneMesh ground = large.meshes[0];
  ground.positions.clear();
  ground.normals.clear();
  ground.texture_coordinates.clear();
  ground.triangles.clear();
  constexpr int side = 708;
  for (int z = 0; z <= side; ++z)
    for (int x = 0; x <= side; ++x) {
      ground.positions.emplace_back(0.02f * x - 7.0f, 0.01f + 0.02f * ((x ^ z) & 1),
                                    0.02f * z - 7.0f);
      ground.normals.emplace_back(0.0f, 1.0f, 0.0f);
    }
  for (int z = 0; z < side; ++z)
    for (int x = 0; x < side; ++x) {
      const auto a = static_cast<std::uint32_t>(z * (side + 1) + x);
      const std::uint32_t b = a + 1, c = a + side + 1, d = c + 1;
      ground.triangles.insert(ground.triangles.end(), {a, c, b, b, c, d});
    }
  ASSERT_GT(ground.triangles.size() / 3, 1'000'000u);
  large.meshes.push_back(std::move(ground));
  RenderFrame frame;
  frame.width = 8192;
  frame.height = 32;
  frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, 8192, 32, 120.0);
  frame.lights = large.lights;
  frame.exposure = large.exposure;
  frame.scene = std::make_shared<const Scene>(std::move(large));
  frame.subjects.push_back({&figure.mesh, {}, 0});
  const auto renderer = make_renderer();
  Rectangle changed;
  const Picture picture = drawn(*renderer, frame, {}, changed);
  EXPECT_FALSE(changed.empty());
  EXPECT_EQ(drawn(*renderer, frame, {}, changed).pixels, picture.pixels);
  // What the scene is made of counts once.
  EXPECT_TRUE(renderer->statistics().scene_depth_reused);
}

INSTANTIATE_TEST_SUITE_P(Api, CompositeStress, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
