// SPDX-License-Identifier: LGPL-2.1-or-later
// Lamps that are dimmed and coloured one by one, against the light computed anew.
#include "view/lamp_mix.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <functional>
#include <vector>

#include "builtin/shapes.h"
#include "support/picture_error.h"
#include "view/background.h"

namespace polyhull {
namespace {

using synthetic::furthest;

/// A box on a floor of which both sides are seen, before a mirror, under a lamp that is seen, a point and
/// a spot; with \p more a sky and something else that glows.
Scene small_scene(bool more) {
  Scene scene;
  scene.materials.resize(5);
  scene.materials[0].base_colour = {0.8f, 0.3f, 0.2f};
  scene.materials[1].double_sided = true;
  scene.materials[2].base_colour = Vec3f(0.9f);
  scene.materials[2].metallic = 1.0f;
  scene.materials[2].roughness = 0.0f;
  scene.materials[3].emission = {6.0f, 5.0f, 4.0f};
  if (more) scene.materials[4].emission = {0.0f, 0.3f, 0.6f};
  scene.meshes = {box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}),
                  parallelogram("floor", 1, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
                  parallelogram("mirror", 2, {-1, 0, -1}, {2, 0, 0}, {0, 1.5f, 0}),
                  parallelogram("lamp", 3, {-0.2f, 1.8f, -0.2f}, {0.4f, 0, 0}, {0, 0, 0.4f}),
                  box("glow", 4, {0.5f, 0, 0.2f}, {0.6f, 0.1f, 0.3f})};
  scene.lights = {
      {"lamp", {0, 1.8f, 0}, {0.2f, 0, 0}, {0, 0, 0.2f}, {6, 5, 4}, 3},
      {"point", {0.8f, 1.0f, 0.7f}, Vec3f(0.0f), Vec3f(0.0f), {0.5f, 0.5f, 0.9f}, -1},
      {"spot", {-0.8f, 1.5f, 0.6f}, {0.05f, 0, 0}, {0, 0, 0.05f}, Vec3f(90.0f), -1, 0.3f, 0.45f}};
  if (more) scene.sky = {0.05f, 0.06f, 0.1f};
  scene.mirrors = find_mirrors(scene);
  return scene;
}

const Camera camera = look_at({0.9, 1.3, 1.8}, {0, 0.2, -0.2}, 50, 96, 72);

BackgroundOptions settings(bool progressive = false) {
  BackgroundOptions options;
  options.light.spacing = 0.05f;
  options.light.bounce_spacing = 0.25f;
  options.light.light_samples = 64;
  options.light.bounce_samples = 64;
  options.progressive = progressive;
  return options;
}

using Lights = std::vector<Light>;

/// The picture under \p lights of a background that has never had others.
std::vector<Vec3f> anew(const Scene& scene, const Lights& lights) {
  Background background(scene, settings());
  background.update(camera, lights, 0.5f);
  return background.picture();
}

/// The changes that are tried one after the other.
const std::vector<std::function<void(Lights&)>>& changes() {
  static const std::vector<std::function<void(Lights&)>> all = {
      [](Lights& l) { l[0].radiance *= 0.3f; },
      [](Lights& l) {
        l[1].radiance = {1.5f, 0.2f, 0.1f};
      },
      [](Lights& l) { l[2].radiance *= 0.0f; },
      [](Lights& l) { l[0].radiance *= 0.0f, l[1].radiance *= 2.0f, l[2].radiance *= 0.5f; },
      [](Lights& l) {
        for (Light& light : l) light.radiance *= 0.4f;
      },
      [](Lights& l) {
        for (Light& light : l) light.radiance *= 0.0f;
      },
  };
  return all;
}

void expect_the_light_computed_anew(const Scene& scene) {
  Background background(scene, settings());
  EXPECT_EQ(background.update(camera, scene.lights, 0.5f), Background::Work::lit);
  for (std::size_t i = 0; i < changes().size(); ++i) {
    Lights lights = scene.lights;
    changes()[i](lights);
    EXPECT_EQ(background.update(camera, lights, 0.5f), Background::Work::drawn) << i;
    EXPECT_LT(furthest(background.picture(), anew(scene, lights)), 1e-5f) << i;  // rounding
  }
}

TEST(LampMixTest, IsTheLightComputedAnew) {
  expect_the_light_computed_anew(small_scene(false));
}

TEST(LampMixTest, IsTheLightComputedAnewUnderASky) {
  expect_the_light_computed_anew(small_scene(true));
}

/// What a lamp gives is asked for once; all that has been changed can be taken back to the bit.
TEST(LampMixTest, EachLampIsAskedForOnce) {
  const Scene scene = small_scene(false);
  Background background(scene, settings());
  background.update(camera, scene.lights, 0.5f);
  const std::vector<Vec3f> first = background.picture();
  const std::uint64_t whole = background.light_rays();
  Lights lights = scene.lights;
  lights[1].radiance *= 0.7f;
  background.update(camera, lights, 0.5f);
  const std::uint64_t one = background.light_rays();
  EXPECT_GT(one, whole);
  EXPECT_LT(one, 2 * whole);
  for (const float factor : {0.1f, 3.0f}) {
    lights[1].radiance = factor * Vec3f(0.3f, 0.5f, 0.1f);
    background.update(camera, lights, 0.5f);
  }
  // All by the same factor but for this one: it is still the only one that differs.
  for (Light& light : lights) light.radiance *= 0.5f;
  background.update(camera, lights, 0.5f);
  EXPECT_EQ(background.light_rays(), one);
  background.update(camera, scene.lights, 0.5f);
  EXPECT_EQ(background.picture(), first);
  // A lamp that moves has all computed anew.
  lights = scene.lights;
  lights[0].centre.x += 0.1f;
  EXPECT_EQ(background.update(camera, lights, 0.5f), Background::Work::lit);
}

TEST(LampMixTest, BecomesExactWhileFramesFlow) {
  const Scene scene = small_scene(false);
  Lights lights = scene.lights;
  changes()[3](lights);
  Background at_once(scene, settings()), background(scene, settings(true));
  const auto play = [&](const Lights& now) {
    for (int i = 0; i < 20000 && !background.light_is_exact(); ++i) {
      background.update(camera, now, 0.5f);
      usleep(500);
    }
    EXPECT_TRUE(background.light_is_exact());
  };
  background.update(camera, scene.lights, 0.5f);
  play(scene.lights);
  EXPECT_EQ(background.update(camera, lights, 0.5f), Background::Work::drawn);
  EXPECT_FALSE(background.light_is_exact());
  EXPECT_FALSE(background.refine(camera.height));
  at_once.update(camera, scene.lights, 0.5f);
  at_once.update(camera, lights, 0.5f);
  EXPECT_LT(furthest(background.picture(), at_once.picture()), 0.3f)
      << "near from the first frame on";
  play(lights);
  EXPECT_EQ(background.picture(), at_once.picture());
}

}  // namespace
}  // namespace polyhull
