// SPDX-License-Identifier: LGPL-2.1-or-later
// Several lamps: each takes its own light and colour where the subject stands in its way, those that
// change nothing are left out, and both renderers agree.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "backend.h"
#include "figure_stage.h"
#include "picture_error.h"
#include "shot.h"

namespace polyhull {
namespace {

using synthetic::FigureStage;
using synthetic::floor_scene;
using synthetic::plain_box;
using synthetic::point_lamp;
using synthetic::Shot;

using ManyLightsTest = testing::BackendTest;

/// \p lamp as an area of that power that shines down, or as a spot.
Light spread(Light lamp, bool spot) {
  lamp.u = {0.02f, 0, 0};
  lamp.v = {0, 0, 0.02f};
  lamp.radiance /= 4.0f * 0.02f * 0.02f;
  if (spot) lamp.inner_cone = 1.0f, lamp.outer_cone = 1.4f;
  return lamp;
}

// A plate between two lamps and the floor: where one lamp's light is missing the floor loses that lamp's
// colour, and where both are, both; nowhere is anything taken twice.
TEST_P(ManyLightsTest, EachLampTakesItsOwnColour) {
  Material material;
  material.base_colour = {0.8f, 0.6f, 0.4f};
  const Vec3 places[] = {Vec3(1.0, 2.5, 0.0), Vec3(-1.0, 2.5, 0.0)};
  const Vec3 powers[] = {Vec3(10, 2, 1), Vec3(0, 3, 9)};
  const Mesh plate = plain_box({-0.5f, 0.88f, -0.5f}, {0.5f, 0.9f, 0.5f}, 0.5f);
  for (const std::string kind : {"point", "area", "spot"}) {
    Scene scene = floor_scene(material, {});
    scene.lights.clear();
    for (int i = 0; i < 2; ++i) {
      const Light lamp = point_lamp(Vec3f(places[i]), Vec3f(powers[i]));
      scene.lights.push_back(kind == "point" ? lamp : spread(lamp, kind == "spot"));
    }
    for (const ShadowQuality quality : {ShadowQuality::hard, ShadowQuality::good}) {
      Shot shot(scene, plate, synthetic::look_at({0, 0.5, 2.5}, {0, 0, 0}, 320, 160, 50.0));
      shot.settings.shadow = quality;
      const double background = shot.draw(0.5f);
      const auto lost = [&](int lamp, double x) {
        const Vec3 way = places[lamp] - Vec3(x, 0, 0);
        const double cosine = way.y / glm::length(way);
        return material.base_colour * Vec3f(powers[lamp] * std::numbers::inv_pi * cosine *
                                            (kind == "area" ? cosine : 1.0) / glm::dot(way, way));
      };
      for (const double x : {-0.8, -0.4, 0.0, 0.1, 0.5, 0.9}) {
        Vec3f expected(static_cast<float>(background));
        if (x < 0.2) expected -= lost(0, x);
        if (x > -0.2) expected -= lost(1, x);
        const Vec3f found = shot.at({x, 0, 0});
        for (int c = 0; c < 3; ++c)
          EXPECT_NEAR(found[c], expected[c], 0.008)
              << kind << " quality " << static_cast<int>(quality) << " x " << x << " channel " << c;
      }
      EXPECT_NEAR(shot.at({0.0, 0, 1.1}).x, background, 0.004);
    }
  }
}

/// Lamps around the figure's stage: its own, three of other colours and kinds, and others of no effect.
std::vector<Light> lamps_around(const Light& own) {
  std::vector<Light> out(4, own);
  out[1].centre = {1.6f, 2.8f, 1.2f};
  out[1].radiance *= Vec3f(1.0f, 0.5f, 0.2f);
  out[2].centre = {-1.8f, 2.6f, -0.9f};
  out[2].radiance *= Vec3f(0.2f, 0.6f, 1.2f);
  out[2].inner_cone = 0.6f;
  out[2].outer_cone = 1.2f;
  out[3] = point_lamp({0.6f, 2.7f, -1.6f}, {2.5f, 3.0f, 2.0f});
  return out;
}

std::vector<Light> lamps_of_no_effect(const Light& own) {
  std::vector<Light> out;
  for (int i = 0; i < 36; ++i) {
    Light light = own;
    light.centre = {-2.5f + 0.14f * static_cast<float>(i), 2.9f, -1.5f};
    if (i % 3 == 0) {  // shines up
      light.u = -light.u;
    } else if (i % 3 == 1) {  // shines down beside the figure
      light.centre.x = -2.5f;
      light.inner_cone = 0.1f;
      light.outer_cone = 0.2f;
    } else {
      light.radiance *= 1e-8f;
    }
    out.push_back(light);
  }
  return out;
}

TEST_P(ManyLightsTest, SkippingChangesNoBit) {
  FigureStage stage(240, 135);
  stage.fill_background(200);
  std::vector<Light>& lights = stage.frame.lights;
  const Light own = lights[0];
  lights = lamps_around(own);
  const std::vector<Light> others = lamps_of_no_effect(own);
  lights.insert(lights.begin() + 1, others.begin(), others.begin() + 3);
  stage.frame.subjects[0].content = 1;
  const auto lazy = make_renderer();
  RenderSettings skipping, all;
  all.skip = false;
  for (int i = 0; i < 5; ++i) {
    stage.frame.subjects[0].placement.translate = {0.15 * i - 0.3, 0, 0.1 * i};
    if (i == 3) stage.frame.viewport = synthetic::look_at({1, 1, 4}, {0, 0.4, 0}, 240, 135, 40.0);
    skipping.shadow = all.shadow = i == 3   ? ShadowQuality::best
                                   : i == 4 ? ShadowQuality::hard
                                            : ShadowQuality::good;
    if (i == 2) lights[0].radiance *= 0.1f;  // another one is the strongest now
    if (i == 1) {                            // one is off while the figure moves
      const Light lamp = std::exchange(lights[6], point_lamp(lights[6].centre, Vec3f(0.0f)));
      stage.composite(*lazy, skipping);
      EXPECT_EQ(lazy->statistics().shadow_lights, 3u);
      lights[6] = lamp;
    }
    const Picture found = stage.composite(*lazy, skipping);
    EXPECT_EQ(lazy->statistics().shadow_lights, 4u);
    EXPECT_EQ(lazy->statistics().lights_skipped, 3u);
    const auto fresh = make_renderer();
    EXPECT_TRUE(found.pixels == stage.composite(*fresh, all).pixels) << i;
  }
}

// Of two lamps' shadows of a plate one is outside of the picture: that it is left out changes nothing.
TEST_P(ManyLightsTest, ShadowsBesideThePictureChangeNoBit) {
  Material material;
  material.base_colour = {0.8f, 0.6f, 0.4f};
  Scene scene = floor_scene(material, {});
  scene.lights = {spread(point_lamp({1.0f, 2.5f, 0.0f}, {10, 2, 1}), false),
                  spread(point_lamp({-1.0f, 2.5f, 0.0f}, {43, 310, 877}), false)};
  const Mesh plate = plain_box({-0.5f, 0.88f, -0.5f}, {0.5f, 0.9f, 0.5f}, 0.5f);
  const Camera below = synthetic::look_at({-0.9, 0.7, 0.01}, {-0.9, 0, 0}, 320, 160, 30.0);
  Shot skipping(scene, plate, below), all(scene, plate, below);
  all.settings.skip = false;
  skipping.draw(0.5f);
  all.draw(0.5f);
  const RenderPlan plan = make_renderer()->plan(skipping.frame, skipping.settings);
  EXPECT_EQ(plan.lights.size(), 1u);
  EXPECT_TRUE(skipping.picture.pixels == all.picture.pixels);
}

// Forty lamps of which four matter are those four.
TEST_P(ManyLightsTest, LampsOfNoEffectAreLeftOut) {
  FigureStage stage(320, 180, false);
  stage.fill_background(200);
  std::vector<Light>& lights = stage.frame.lights;
  const Light own = lights[0];
  lights = lamps_around(own);
  const auto few_renderer = make_renderer(), all_renderer = make_renderer();
  const Picture few = stage.composite(*few_renderer, {});
  EXPECT_EQ(few_renderer->statistics().shadow_lights, 4u);
  EXPECT_EQ(few_renderer->statistics().lights_skipped, 0u);
  const std::vector<Light> others = lamps_of_no_effect(own);
  lights.insert(lights.end(), others.begin(), others.end());
  EXPECT_TRUE(stage.composite(*all_renderer, {}).pixels == few.pixels);
  EXPECT_EQ(all_renderer->statistics().shadow_lights, 4u);
  EXPECT_EQ(all_renderer->statistics().lights_skipped, 36u);
  EXPECT_EQ(all_renderer->statistics().rays, few_renderer->statistics().rays);
}

TEST_P(ManyLightsTest, BothRenderersAgree) {
  if (processor()) GTEST_SKIP() << "with itself";
  FigureStage stage(640, 360);
  stage.fill_background(200);
  stage.frame.lights = lamps_around(stage.frame.lights[0]);
  const auto renderer = make_renderer();
  ProcessorRenderer processor;
  const Picture with_gl = stage.composite(*renderer, {}), plain = stage.composite(processor, {});
  const double alike = synthetic::psnr(with_gl, plain);
  std::printf("OpenGL and the processor: %.1f dB\n", alike);
  EXPECT_GT(alike, 42.0);
  EXPECT_LT(synthetic::psnr(plain, stage.background), 30.0) << "there is something to be seen";
}

INSTANTIATE_TEST_SUITE_P(Api, ManyLightsTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
