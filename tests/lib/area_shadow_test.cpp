// SPDX-License-Identifier: LGPL-2.1-or-later
// The processor's shadows against very many rays: the share of the lamps' light that subjects take.
#include "render/processor/area_shadow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "figure_stage.h"
#include "raytrace/area_light.h"
#include "synthetic.h"

namespace polyhull::processor {
namespace {

/// A figure on a floor beside a pillar that shades, too, under lamps.
struct Stage {
  Scene scene;
  std::unique_ptr<TracedScene> traced;
  Mesh mesh;
  RenderFrame frame;
  RenderPlan plan;
  SceneLayer layer;

  Stage(int width, int height, int count = 1, Scene room = synthetic::small_room(false))
      : scene(std::move(room)) {
    scene.lights = synthetic::ceiling_lamps(scene.lights[0], count);
    // All places in blocks of any even size, and about as many rays to all lamps together.
    stride = count == 1 ? 7 : count < 10 ? 17 : 61;
    mesh.hull = synthetic::figure(20);
    traced = std::make_unique<TracedScene>(scene);
    frame.width = width;
    frame.height = height;
    frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.7, 0.0}, width, height, 50.0);
    frame.scene = std::make_shared<const Scene>(scene);
    frame.lights = scene.lights;
    frame.subjects.push_back({&mesh, {}, 1});
    plan = plan_frame(frame, {}, scene_bounds(scene));
    layer.set(traced.get(), {pixels_from_scene(frame.viewport), width, height, 4, {}});
    layer.ensure_middles({0, 0, width, height});
  }
  int stride = 5;  // of the pixels that are compared

  /// Where rays to the light start at the middle of pixel (x, y), and the normal there.
  Surface surface(int x, int y) const {
    const RayHit hit = layer.hit(x, y);
    Ray ray;
    ray.origin = Vec3f(plan.eye);
    ray.direction = Vec3f(frame.viewport.ray({static_cast<double>(x), static_cast<double>(y)}));
    return traced->surface(ray, hit);
  }
};

/// What all lamps give, all channels together, at every stride-th pixel of every stride-th row.
struct Truth {
  std::vector<double> whole;  ///< 0: no light falls there
  std::vector<double> taken;
};

/// By \p side x \p side rays to each lamp.
Truth truth(const Stage& stage, int side) {
  RayCaster subjects;
  subjects.add_mesh(stage.plan.subjects[0].points, stage.mesh.hull.triangles);
  subjects.commit();
  Truth out;
  for (int y = 0; y < stage.frame.height; y += stage.stride) {
    for (int x = 0; x < stage.frame.width; x += stage.stride) {
      double whole = 0.0, taken = 0.0;
      if (stage.layer.hit(x, y).hit()) {
        for (const Light& light : stage.frame.lights) {
          const synthetic::LightAt there =
              synthetic::light_at(light, *stage.traced, subjects, stage.surface(x, y), side);
          const double radiance = light.radiance.x + light.radiance.y + light.radiance.z;
          whole += radiance * there.whole;
          taken += radiance * there.taken;
        }
      }
      out.whole.push_back(whole);
      out.taken.push_back(taken);
    }
  }
  return out;
}

struct Errors {
  double rms = 0.0, bias = 0.0, p99 = 0.0;
  int pixels = 0;
};

/// What \p quality takes of the plan's lights at the same pixels, all channels together.
std::vector<double> taken(Stage& stage, ShadowQuality quality) {
  RenderSettings settings;
  settings.shadow = quality;
  SolidSubjects solid;
  std::vector<double> out;
  for (const ShadowLight& planned : stage.plan.lights) {
    const Light& light = stage.frame.lights[planned.light];
    const ShadowRecipe recipe = shadow_recipe(settings, light, planned.share);
    ShadowCasters casters;
    casters.set(stage.plan, solid, light, recipe, false);
    AreaShadow shadow;
    const ShadowView view{stage.layer, Vec3f(stage.plan.eye), PixelRays(stage.frame.viewport)};
    shadow.begin(casters, view, light, recipe, {0, 0, stage.frame.width, stage.frame.height});
    shadow.draw(casters, *stage.traced, view, light);
    const Vec3f power = light_power(light);
    std::size_t next = 0;
    for (int y = 0; y < stage.frame.height; y += stage.stride) {
      for (int x = 0; x < stage.frame.width; x += stage.stride) {
        float row[16] = {};
        shadow.taken(stage.layer, x & ~15, y, row);
        out.resize(std::max(out.size(), next + 1));
        out[next++] += row[x & 15] * (power.x + power.y + power.z);
      }
    }
  }
  return out;
}

/// Of the share of the light, over the pixels that either says are shaded.
Errors errors(Stage& stage, ShadowQuality quality, const Truth& truth) {
  const std::vector<double> found = taken(stage, quality);
  Errors out;
  std::vector<double> all;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (truth.whole[i] == 0.0 || (truth.taken[i] == 0.0 && found[i] == 0.0)) continue;
    const double error = (found[i] - truth.taken[i]) / truth.whole[i];
    out.rms += error * error;
    out.bias += error;
    all.push_back(std::abs(error));
  }
  out.pixels = static_cast<int>(all.size());
  out.rms = std::sqrt(out.rms / out.pixels);
  out.bias /= out.pixels;
  std::sort(all.begin(), all.end());
  out.p99 = all[all.size() * 99 / 100];
  return out;
}

// A plate right below the lamp takes all of its light, so subjects take none.
TEST(AreaShadow, TheSceneHidesTheLampFromCloseBy) {
  Scene room = synthetic::small_room(false);
  const Light& lamp = room.lights[0];
  const Vec3f below = lamp.centre - Vec3f(0.0f, 0.1f, 0.0f);
  SceneMesh plate;
  for (const Vec2f& at : {Vec2f(-1, -1), Vec2f(1, -1), Vec2f(1, 1), Vec2f(-1, 1)})
    plate.positions.push_back(below + 2.5f * (at.x * lamp.u + at.y * lamp.v));
  plate.normals.assign(4, {0.0f, -1.0f, 0.0f});
  plate.triangles = {0, 1, 2, 0, 2, 3};
  room.meshes.push_back(plate);
  Stage hidden(320, 180, 1, room), open(320, 180);
  EXPECT_GT(std::ranges::max(taken(open, ShadowQuality::good)), 0.0);
  EXPECT_EQ(std::ranges::max(taken(hidden, ShadowQuality::good)), 0.0);
}

TEST(AreaShadow, ConvergesToTheLampsShadow) {
  for (const int count : {1, 4, 40}) {
    Stage stage(1280, 720, count);
    const Truth expected = truth(stage, 32);
    const struct {
      ShadowQuality quality;
      const char* name;
      double rms, p99;
    } bars[] = {{ShadowQuality::fast, "fast", 0.018, 0.055},
                {ShadowQuality::good, "good", count == 1 ? 0.0095 : 0.012, 0.029},
                {ShadowQuality::best, "best", 0.005, 0.018}};
    for (const auto& bar : bars) {
      const Errors found = errors(stage, bar.quality, expected);
      std::printf("%d lamps, %s: RMS %.4f, bias %+.4f, 99 %% below %.4f, of %d pixels\n", count,
                  bar.name, found.rms, found.bias, found.p99, found.pixels);
      EXPECT_GT(found.pixels, 200000 / (stage.stride * stage.stride));
      EXPECT_LT(found.rms, bar.rms) << bar.name;
      EXPECT_LT(std::abs(found.bias), 0.002) << bar.name;
      EXPECT_LT(found.p99, bar.p99) << bar.name;
    }
  }
}

/// A lamp above the middle of the floor that shines down.
Light lamp() {
  Light light;
  light.centre = {0.3f, 2.6f, -0.2f};
  light.u = {0.4f, 0.0f, 0.0f};
  light.v = {0.0f, 0.0f, 0.3f};
  return light;
}

/// Of how many of \p receivers each of \p places is hidden by masks of the triangles.
struct Masked {
  LightReach reach;
  LightMasks masks;
  bool ready = false;

  Masked(const Light& light, std::span<const Vec3f> points,
         std::span<const std::uint32_t> triangles) {
    reach.build(light, points, triangles);
    ready = masks.set(reach, points, triangles);
  }
  /// A bit for each of \p places, of which there are at most 32.
  std::uint32_t hidden(std::span<const Vec3f> places, const Vec3f& receiver) {
    const LightReach::Place at = reach.place(receiver);
    std::uint32_t found = 0;
    masks.find_hidden(0, static_cast<int>(places.size()),
                      {1, &at.tangents.x, &at.tangents.y, &at.inverse}, &found);
    return found;
  }
};

TEST(LightMasks, HideWhatRaysFindBlocked) {
  const Hull figure = synthetic::figure(20);
  const Light light = lamp();
  Masked masked(light, figure.vertices, figure.triangles);
  ASSERT_TRUE(masked.ready);
  RayCaster caster;
  caster.add_mesh(figure.vertices, figure.triangles);
  caster.commit();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  std::vector<Vec3f> places;
  for (int i = 0; i < 32; ++i)
    places.push_back(light.centre + any(random) * light.u + any(random) * light.v);
  masked.masks.aim(places);
  int blocked = 0, wrong = 0, more = 0;
  for (int i = 0; i < 20000; ++i) {
    // On the floor, and between the floor and the lamp, before and behind the figure and in it.
    const Vec3f place(any(random), i % 2 ? -0.001f : 1.2f + 1.2f * any(random), any(random));
    const std::uint32_t hidden = masked.hidden(places, place);
    for (std::size_t k = 0; k < places.size(); ++k) {
      const bool found = hidden >> k & 1,
                 truth = caster.occluded({place, 0.0f, places[k] - place, 1.0f});
      blocked += truth;
      wrong += found != truth;
      more += found - truth;
    }
  }
  EXPECT_GT(blocked, 40000);
  EXPECT_LT(wrong, blocked / 25) << "more than along the outline";
  EXPECT_LT(std::abs(more), blocked / 100) << "the outline is too wide or too narrow";
}

// A sheet has no inside, and is thinner than what lies between two sections.
TEST(LightMasks, SheetsHideWhatLiesBehindThem) {
  const std::vector<Vec3f> corners{
      {-0.3f, 0.9f, -0.3f}, {0.3f, 0.9f, -0.3f}, {0.3f, 1.1f, 0.3f}, {-0.3f, 1.1f, 0.3f}};
  for (const bool closed : {false, true}) {
    std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
    if (closed) triangles.insert(triangles.end(), {0, 2, 1, 0, 3, 2});
    Masked masked(lamp(), corners, triangles);
    ASSERT_TRUE(masked.ready);
    const std::vector<Vec3f> places{lamp().centre, lamp().centre + lamp().u,
                                    lamp().centre - lamp().v};
    masked.masks.aim(places);
    for (int x = -5; x <= 5; ++x) {
      for (int z = -5; z <= 5; ++z) {
        const Vec3f on(0.05f * static_cast<float>(x), 1.0f + 0.1f * static_cast<float>(z) / 6.0f,
                       0.05f * static_cast<float>(z));
        for (std::size_t k = 0; k < places.size(); ++k) {
          EXPECT_TRUE(masked.hidden(places, places[k] + 1.5f * (on - places[k])) >> k & 1);
          EXPECT_FALSE(masked.hidden(places, places[k] + 0.8f * (on - places[k])) >> k & 1);
        }
      }
    }
  }
}

// A brim above shoulders: what is thin keeps its shadow between it and the solid below.
TEST(LightMasks, WhatIsThinHidesAboveWhatIsSolid) {
  std::vector<Vec3f> corners;
  std::vector<std::uint32_t> triangles;
  const auto add_box = [&](float half, float low, float high) {
    const auto first = static_cast<std::uint32_t>(corners.size());
    for (int k = 0; k < 8; ++k)
      corners.emplace_back(k & 1 ? half : -half, k & 4 ? high : low, k & 2 ? half : -half);
    for (const std::uint32_t corner :
         {0u, 1u, 2u, 1u, 3u, 2u, 4u, 6u, 5u, 5u, 6u, 7u, 0u, 4u, 1u, 1u, 4u, 5u,
          2u, 3u, 6u, 3u, 7u, 6u, 0u, 2u, 4u, 2u, 6u, 4u, 1u, 5u, 3u, 3u, 5u, 7u})
      triangles.push_back(first + corner);
  };
  add_box(0.3f, 0.2f, 0.6f);
  add_box(0.3f, 1.2f, 1.201f);
  Masked masked(lamp(), corners, triangles);
  ASSERT_TRUE(masked.ready);
  const std::vector<Vec3f> places{lamp().centre};
  masked.masks.aim(places);
  for (const float x : {-0.15f, 0.0f, 0.1f}) {
    EXPECT_EQ(masked.hidden(places, {x, 0.9f, 0.0f}), 1u) << x;
    EXPECT_EQ(masked.hidden(places, {x, 1.4f, 0.0f}), 0u) << x;
  }
}

// What another subject hides stays hidden.
TEST(LightMasks, AddToWhatIsHidden) {
  const std::vector<Vec3f> corners{
      {-0.3f, 0.9f, -0.3f}, {0.3f, 0.9f, -0.3f}, {0.3f, 1.1f, 0.3f}, {-0.3f, 1.1f, 0.3f}};
  Masked masked(lamp(), corners, std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
  ASSERT_TRUE(masked.ready);
  const std::vector<Vec3f> places{lamp().centre};
  masked.masks.aim(places);
  for (const float y : {0.0f, 1.5f}) {  // behind it and before it
    const LightReach::Place at = masked.reach.place({0.0f, y, 0.0f});
    std::uint32_t hidden = 3;
    masked.masks.find_hidden(0, 1, {1, &at.tangents.x, &at.tangents.y, &at.inverse}, &hidden);
    EXPECT_EQ(hidden, 3u) << y;
  }
}

// Far from the origin places lie where single floats put them: nothing is drawn beside the images.
TEST(LightMasks, KeepToTheirImagesFarAway) {
  for (const float far : {2e5f, 5e6f}) {
    Light light = lamp();
    const Vec3f shift(far, 0.0f, far);
    light.centre += shift;
    std::vector<Vec3f> corners{{-0.3f, 0.9f, -0.3f}, {0.3f, 0.9f, -0.3f}, {0.3f, 1.1f, 0.3f}};
    for (Vec3f& corner : corners) corner += shift;
    Masked masked(light, corners, std::vector<std::uint32_t>{0, 1, 2});
    if (!masked.ready) continue;
    masked.masks.aim(std::vector<Vec3f>{light.centre + light.u + light.v, light.centre - light.u,
                                        light.centre - light.v});
  }
}

TEST(LightMasks, LeaveToRaysWhatComesNearTheLight) {
  for (const float top : {2.55f, 2.61f}) {
    const std::vector<Vec3f> corners{{0.0f, 0.0f, 0.0f}, {0.1f, 0.0f, 0.0f}, {0.0f, top, 0.0f}};
    EXPECT_FALSE(Masked(lamp(), corners, std::vector<std::uint32_t>{0, 1, 2}).ready);
  }
}

// LightReach may say yes too often, but never no where a subject stands between.
TEST(LightReach, NeverLeavesOutAShadedPlace) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> any(-1.0f, 1.0f);
  const Hull figure = synthetic::figure(12);
  int yes = 0, no = 0, shaded = 0, sure = 0;
  for (int round = 0; round < 40; ++round) {
    Light light;
    light.centre = {2.0f * any(random), 2.6f + 0.5f * any(random), 2.0f * any(random)};
    // Some point lights are between the limbs: no plane parts them from the subject.
    if (round % 8 == 0) light.centre = {0.5f * any(random), 1.0f, 0.4f};
    if (round % 4 != 0) {
      light.u = Vec3f(any(random), 0.3f * any(random), any(random)) * 0.6f;
      light.v = Vec3f(any(random), 0.3f * any(random), any(random)) * 0.4f;
      if (glm::cross(light.u, light.v).y > 0.0f) std::swap(light.u, light.v);  // shines down
    }
    LightReach reach;
    reach.build(light, figure.vertices, figure.triangles);
    RayCaster caster;
    caster.add_mesh(figure.vertices, figure.triangles);
    caster.commit();
    for (int i = 0; i < 2000; ++i) {
      const Vec3f place(3.0f * any(random), i % 2 ? 0.0f : 1.3f + 1.3f * any(random),
                        3.0f * any(random));
      const LightReach::Place in_light = reach.place(place);
      const bool may = reach.may_shade(in_light);
      LightReach::Extent extent;
      extent.add(in_light);
      EXPECT_EQ(reach.may_shade(extent), may);
      const LightReach::Place beside = reach.place(place + Vec3f(0.1f, 0.0f, 0.05f));
      extent.add(beside);
      if (in_light.inverse > 0.0f && beside.inverse > 0.0f && reach.must_shade(extent)) {
        ++sure;
        EXPECT_TRUE(may && reach.may_shade(beside)) << "what it says of all it says of each";
      }
      (may ? yes : no)++;
      bool blocked = false;
      for (int k = 0; k < 16; ++k) {
        const Vec3f target = light.centre + any(random) * light.u + any(random) * light.v;
        // Up to a millimetre before its plane a light counts as not shining.
        if (light.is_area() && glm::dot(light_normal(light), place - target) <= 1.001e-3f) continue;
        blocked = blocked || caster.occluded({place, 0.0f, target - place, 1.0f});
      }
      shaded += blocked;
      EXPECT_TRUE(may || !blocked)
          << "round " << round << " " << place.x << " " << place.y << " " << place.z;
    }
  }
  EXPECT_GT(shaded, 1000);
  EXPECT_GT(no, yes / 4) << "of use only where it says no";
  EXPECT_GT(sure, yes / 4);
}

}  // namespace
}  // namespace polyhull::processor
