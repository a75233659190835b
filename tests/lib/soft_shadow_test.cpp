// SPDX-License-Identifier: LGPL-2.1-or-later
// An environment's shadow, drawn in one, against very many rays: the share of its light that subjects take.
#include "render/processor/soft_shadow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include "base/thread_pool.h"
#include "environment/environment.h"
#include "environment_picture.h"
#include "figure_stage.h"
#include "gl_context.h"
#include "picture_error.h"
#include "raytrace/sampling.h"
#include "render/gl/compositor.h"
#include "render/processor/area_shadow.h"
#include "render/processor/processor_renderer.h"
#include "scene/assumed_light.h"
#include "synthetic.h"

namespace polyhull::processor {
namespace {

/// An overcast sky (CIE: thrice as bright above as at the horizon) over dark ground.
RadiancePicture overcast() {
  RadiancePicture out = test::even_environment(Vec3f(0.1f), 64);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 128; ++x)
      out.pixels[static_cast<std::size_t>(128 * y + x)] =
          Vec3f(0.9f, 0.95f, 1.0f) *
          (1.0f + 2.0f * std::cos((static_cast<float>(y) + 0.5f) * 0.0491f));
  return out;
}

/// Three softboxes of some 30 degrees in a dark studio.
RadiancePicture softboxes() {
  RadiancePicture out = test::even_environment(Vec3f(0.02f), 64);
  const int left[] = {10, 55, 96};
  for (int box = 0; box < 3; ++box)
    for (int y = 10 + 3 * box; y < 20 + 3 * box; ++y)
      for (int x = left[box]; x < left[box] + 12; ++x)
        out.pixels[static_cast<std::size_t>(128 * y + x)] =
            Vec3f(8.0f, 7.0f - static_cast<float>(box), 6.0f);
  return out;
}

/// A figure between a wall and a pillar under the sky.
struct Stage {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>(synthetic::small_room(false));
  std::unique_ptr<TracedScene> traced;
  Mesh mesh;
  RenderFrame frame;
  RenderPlan plan;
  SceneLayer layer;

  /// Of a viewport of \p width pixels the left \p shown ones, if not all.
  Stage(const RadiancePicture& around, ShadowQuality quality, int width, int height,
        int shown = 0) {
    scene->meshes.erase(scene->meshes.begin() + 2, scene->meshes.begin() + 4);
    scene->lights.clear();
    scene->environment = std::make_shared<const Environment>(around, 20.0, "around");
    traced = std::make_unique<TracedScene>(*scene);
    mesh.hull = synthetic::figure(20);
    frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.7, 0.0}, width, height, 50.0);
    if (shown > 0) frame.viewport.width = width = shown;
    frame.width = width;
    frame.height = height;
    frame.scene = scene;
    const std::size_t count = quality == ShadowQuality::best ? 32 : 16;
    frame.lights = environment_lights(*scene, count);
    frame.sky = Vec3f(1.0f);
    frame.soft_light = std::make_shared<const std::vector<EnvironmentPart>>(
        scene->environment->soft_parts(count, 32 * count));
    frame.subjects.push_back({&mesh, {}, 1});
    settings.shadow = quality;
    make_plan();
    layer.set(traced.get(), {pixels_from_scene(frame.viewport), width, height, 4, {}});
    layer.ensure_middles({0, 0, width, height});
  }
  RenderSettings settings;
  void make_plan() { plan = plan_frame(frame, settings, scene_bounds(*scene), true); }
  ShadowView view() const { return {layer, Vec3f(plan.eye), PixelRays(frame.viewport)}; }

  /// Where light falls at the middle of pixel (x, y).
  Surface surface(int x, int y) const {
    Ray ray;
    ray.origin = Vec3f(plan.eye);
    ray.direction = Vec3f(frame.viewport.ray({static_cast<double>(x), static_cast<double>(y)}));
    return traced->surface(ray, layer.hit(x, y));
  }

  /// What is taken by channel at each \p stride-th pixel of each stride-th row: of soft light, and of the rest.
  std::vector<Vec3f> taken(int stride) const {
    const Rectangle whole{0, 0, frame.width, frame.height};
    SoftMasks masks;
    masks.set(plan, frame.soft_light, false);
    for (std::size_t side = 0; side < SoftMasks::sides; ++side) masks.cut(plan, side);
    masks.aim();
    SoftShadow soft;
    soft.draw(masks, *traced, view(), whole, settings.shadow == ShadowQuality::best ? 2 : 4);
    std::vector<Vec3f> out;
    for (int y = 0; y < frame.height; y += stride)
      for (int x = 0; x < frame.width; x += stride) {
        float row[3][16] = {};
        if (soft.reaches(x & ~15, y)) soft.taken(layer, x & ~15, y, row);
        out.emplace_back(row[0][x & 15], row[1][x & 15], row[2][x & 15]);
      }
    SolidSubjects solid;
    for (const ShadowLight& planned : plan.lights) {
      const Light& light = frame.lights[planned.light];
      const ShadowRecipe recipe = shadow_recipe(settings, light, planned.share, planned.sharp);
      ShadowCasters casters;
      casters.set(plan, solid, light, recipe, false);
      AreaShadow shadow;
      shadow.begin(casters, view(), light, recipe, whole);
      shadow.draw(casters, *traced, view(), light);
      const float area = 4.0f * glm::length(glm::cross(light.u, light.v));
      std::size_t next = 0;
      for (int y = 0; y < frame.height; y += stride)
        for (int x = 0; x < frame.width; x += stride) {
          float row[16] = {};
          shadow.taken(layer, x & ~15, y, row);
          out[next++] += row[x & 15] * area * light.radiance;
        }
    }
    return out;
  }
};

/// Of green.
float most_of(const std::vector<Vec3f>& taken) {
  float most = 0.0f;
  for (const Vec3f& own : taken) most = std::max(most, own.y);
  return most;
}

struct Errors {
  double rms = 0.0, bias = 0.0, p99 = 0.0;
  int pixels = 0;
};

/// Of the share of the light that falls there without the figure, all channels together, over the pixels that
/// either says are shaded; by \p rays to the picture.
Errors errors(const Stage& stage, int stride, std::uint32_t rays) {
  const std::vector<Vec3f> found = stage.taken(stride);
  RayCaster figure;
  figure.add_mesh(stage.plan.subjects[0].points, stage.mesh.hull.triangles);
  figure.commit();
  Errors out;
  std::vector<double> all;
  std::size_t next = 0;
  for (int y = 0; y < stage.frame.height; y += stride) {
    for (int x = 0; x < stage.frame.width; x += stride) {
      const Vec3f own = found[next++];
      if (!stage.layer.hit(x, y).hit()) continue;
      const Surface at = stage.surface(x, y);
      const Vec3f origin = at.lifted + stage.traced->epsilon() * at.geometric;
      double whole = 0.0, taken = 0.0;
      for (std::uint32_t i = 0; i < rays; ++i) {
        const EnvironmentSample sample =
            stage.scene->environment->sample(sample_point(i, static_cast<std::uint32_t>(next)));
        const float cosine = glm::dot(at.normal, sample.direction);
        if (!(cosine > 0.0f) || !(sample.density > 0.0f)) continue;
        const Ray ray{origin, 0.0f, sample.direction};
        if (stage.traced->caster().occluded(ray)) continue;
        const double value =
            cosine / sample.density / rays * glm::dot(sample.radiance, Vec3f(1.0f));
        whole += value;
        if (figure.occluded(ray)) taken += value;
      }
      const double given = glm::dot(own, Vec3f(1.0f));
      if (whole == 0.0 || (taken == 0.0 && given == 0.0)) continue;
      const double error = (given - taken) / whole;
      out.rms += error * error;
      out.bias += error;
      all.push_back(std::abs(error));
    }
  }
  out.pixels = static_cast<int>(all.size());
  out.rms = std::sqrt(out.rms / out.pixels);
  out.bias /= out.pixels;
  std::sort(all.begin(), all.end());
  out.p99 = all[all.size() * 99 / 100];
  return out;
}

TEST(SoftShadow, ConvergesToTheEnvironmentsShadow) {
  const struct {
    const char* name;
    RadiancePicture picture;
    double good, best;  // RMS
  } pictures[] = {{"a sky with a sun", test::outdoors(64), 0.0125, 0.006},
                  {"overcast", overcast(), 0.009, 0.0055},
                  {"softboxes", softboxes(), 0.009, 0.005}};
  for (const auto& [name, picture, good_bar, best_bar] : pictures)
    for (const ShadowQuality quality : {ShadowQuality::good, ShadowQuality::best}) {
      const bool best = quality == ShadowQuality::best;
      const Stage stage(picture, quality, 1280, 720);
      const Errors found = errors(stage, 53, 4096);
      std::printf("%s, %s: RMS %.4f, bias %+.4f, 99 %% below %.4f, of %d pixels; %zu suns\n", name,
                  best ? "best" : "good", found.rms, found.bias, found.p99, found.pixels,
                  stage.plan.lights.size());
      EXPECT_GT(found.pixels, 200);
      EXPECT_LT(found.rms, best ? best_bar : good_bar) << name;
      EXPECT_LT(std::abs(found.bias), 0.002) << name;
    }
}

/// The same in whole composites.
struct Yard : synthetic::FigureStage {
  Yard(int width, int height, bool polished) : FigureStage(width, height, polished) {
    auto open = std::make_shared<Scene>(*scene);
    open->meshes.erase(open->meshes.begin() + 2, open->meshes.begin() + 4);
    open->lights.clear();
    open->environment = std::make_shared<const Environment>(test::outdoors(64), 20.0, "around");
    scene = frame.scene = open;
    frame.lights = environment_lights(*open, 16);
    frame.sky = Vec3f(1.0f);
    frame.exposure = 0.25f;
    frame.soft_light = std::make_shared<const std::vector<EnvironmentPart>>(
        open->environment->soft_parts(16, 512));
    fill_background(150);
  }
};

// What is kept from frame to frame, and left out, changes nothing; nor does the number of threads.
TEST(SoftShadow, SkippingChangesNoBit) {
  Yard yard(240, 135, true);
  yard.frame.subjects[0].content = 1;
  ProcessorRenderer lazy;
  RenderSettings skipping, all;
  all.skip = false;
  for (int i = 0; i < 6; ++i) {
    yard.frame.subjects[0].placement.translate = {0.15 * i - 0.3, 0, 0.1 * i};
    if (i == 2) yard.frame.viewport = synthetic::look_at({1, 1, 4}, {0, 0.4, 0}, 240, 135, 40.0);
    skipping.shadow = all.shadow = i == 3 ? ShadowQuality::best : ShadowQuality::good;
    if (i == 4) {  // each light for itself, while the figure moves
      const auto soft = std::exchange(yard.frame.soft_light, nullptr);
      yard.composite(lazy, skipping);
      yard.frame.soft_light = soft;
    }
    const Picture found = yard.composite(lazy, skipping);
    EXPECT_EQ(lazy.statistics().shadow_lights, 16u);
    EXPECT_TRUE(found.pixels == yard.composite(lazy, skipping).pixels) << "a still frame";
    ProcessorRenderer fresh;
    set_pool_threads(i % 2 ? 1 : 0);
    EXPECT_TRUE(found.pixels == yard.composite(fresh, all).pixels) << i;
    set_pool_threads(0);
    EXPECT_LT(synthetic::psnr(found, yard.background), 30.0) << "there is something to be seen";
  }
}

/// A yard with a polished floor and a pane of metal, each seen in the other.
struct MirroredYard : Yard {
  MirroredYard() : Yard(224, 126, true) {
    auto two = std::make_shared<Scene>(*scene);
    Material metal;
    metal.base_colour = {0.9f, 0.85f, 0.8f};
    metal.metallic = 1.0f;
    metal.roughness = 0.0f;
    two->materials.push_back(metal);
    SceneMesh pane;
    pane.material = static_cast<int>(two->materials.size()) - 1;
    pane.positions = {
        {-0.9f, 0.1f, -0.9f}, {0.9f, 0.1f, -0.9f}, {0.9f, 2.2f, -0.9f}, {-0.9f, 2.2f, -0.9f}};
    pane.normals.assign(4, {0.0f, 0.0f, 1.0f});
    pane.triangles = {0, 1, 2, 0, 2, 3};
    two->meshes.push_back(pane);
    two->mirrors = find_mirrors(*two);
    scene = frame.scene = two;
    // Of all codes, even ones and such that change from pixel to pixel.
    for (int y = 0; y < frame.height; ++y)
      for (int x = 0; x < frame.width; ++x)
        for (int c = 0; c < 3; ++c)
          background.pixels[static_cast<std::size_t>(4 * (y * frame.width + x) + c)] =
              static_cast<std::uint8_t>(37 * (x / 16) + 101 * (y / 8) + 17 * c +
                                        (y % 2 ? x * 7 % 5 : 0));
  }
  /// Eight pixels of each 24 become so, in all degrees.
  void make_translucent() {
    for (std::size_t i = 3; i < background.pixels.size(); i += 4)
      background.pixels[i] = static_cast<std::uint8_t>(i / 32 % 3 ? 255 : i / 32 * 29);
  }
};

// The same in a mirror in a mirror, over what is dark, bright and translucent; and drawn in one it is what each
// light's for itself is.
TEST(SoftShadow, SkippingChangesNoBitInMirrorsAndOverAlpha) {
  for (const bool translucent : {false, true}) {
    MirroredYard yard;
    ASSERT_EQ(yard.scene->mirrors.size(), 2u);
    if (translucent) yard.make_translucent();
    for (const ShadowQuality quality :
         {ShadowQuality::fast, ShadowQuality::good, ShadowQuality::best}) {
      RenderSettings settings;
      settings.shadow = quality;
      settings.mirror_depth = 2;
      settings.alpha = translucent ? AlphaCoding::straight : AlphaCoding::ignored;
      ProcessorRenderer renderer;
      const Picture found = yard.composite(renderer, settings);
      EXPECT_EQ(renderer.statistics().mirrors, 4u);
      const std::uint64_t shaded = renderer.statistics().pixels_shaded;
      settings.skip = false;
      EXPECT_TRUE(found.pixels == yard.composite(renderer, settings).pixels);
      if (!translucent) {
        EXPECT_LT(1.05 * static_cast<double>(shaded),
                  static_cast<double>(renderer.statistics().pixels_shaded))
            << "where it cannot be seen nothing is put together";
      }
      settings.skip = true;
      const auto soft = std::exchange(yard.frame.soft_light, nullptr);
      const double alike = synthetic::psnr(found, yard.composite(renderer, settings));
      yard.frame.soft_light = soft;
      std::printf("in mirrors, together and each for itself: %.1f dB\n", alike);
      EXPECT_GT(alike, translucent ? 33.0 : 42.0) << "the codes of what hardly covers differ most";
      EXPECT_LT(synthetic::psnr(found, yard.background), 30.0) << "there is something to be seen";
    }
  }
}

// Where the picture ends is no matter but for what gathers beyond: three pixels of the grid.
TEST(SoftShadow, IsThatOfAnyWidth) {
  const Stage whole(overcast(), ShadowQuality::good, 256, 135);
  const std::vector<Vec3f> expected = whole.taken(1);
  for (const int width : {243, 1}) {
    const Stage part(overcast(), ShadowQuality::good, 256, 135, width);
    const std::vector<Vec3f> found = part.taken(1);
    ASSERT_EQ(found.size(), static_cast<std::size_t>(width) * 135);
    float most = 0.0f, darkest = 0.0f;
    for (int y = 0; y < 135; ++y)
      for (int x = 0; x < width; ++x) {
        const Vec3f &own = found[static_cast<std::size_t>(y * width + x)],
                    &other = expected[static_cast<std::size_t>(y * 256 + x)];
        darkest = std::max(darkest, other.y);
        most = std::max(most, std::abs(own.y - other.y));
        if (x < width - 16) {
          ASSERT_EQ(own, other) << x << ", " << y;
        }
      }
    if (width > 1) {
      EXPECT_GT(darkest, 0.0f);
    }
    EXPECT_LT(most, 0.2f * most_of(expected)) << "at the edge fewer neighbours are gathered";
  }
}

// Each of two subjects hides what it does alone, and together they do not hide less, nor more than the sum.
TEST(SoftShadow, IsThatOfSubjectsApart) {
  Stage stage(overcast(), ShadowQuality::good, 320, 180);
  const auto of = [&](std::initializer_list<Vec3> places) {
    stage.frame.subjects.clear();
    for (const Vec3& place : places)
      stage.frame.subjects.push_back({&stage.mesh, {.translate = place}, 1});
    stage.make_plan();
    return stage.taken(1);
  };
  const Vec3 here(0.0), beside(-1.1, 0.0, 0.6), below(30.0, -100.0, 0.0);
  const std::vector<Vec3f> first = of({here}), second = of({beside}), both = of({here, beside});
  EXPECT_TRUE(both == of({beside, here}));
  EXPECT_TRUE(first == of({here, below})) << "the floor is between, and far is no matter";
  // Pixels that nobody can shade count as unshaded, whatever they face: which these are differs.
  const float some = 0.01f * most_of(both);
  for (std::size_t i = 0; i < both.size(); ++i) {
    ASSERT_GE(both[i].y, std::max(first[i].y, second[i].y) - some) << i;
    ASSERT_LE(both[i].y, first[i].y + second[i].y + some) << i;
  }
}

// Soft lights in one take none of the places for shadows that lamps have, however many those are.
TEST(SoftShadow, LeavesLampsTheirPlaces) {
  Yard yard(64, 36, false);
  RenderFrame& frame = yard.frame;
  frame.width = 3840;
  frame.height = 2160;
  const std::vector<Light> sky = frame.lights;
  const auto soft = static_cast<std::size_t>(
      std::count_if(sky.begin(), sky.end(), [](const Light& light) { return light.soft; }));
  for (const std::size_t count : {4u, 40u}) {
    frame.lights =
        synthetic::ceiling_lamps(synthetic::small_room(false).lights[0], static_cast<int>(count));
    frame.lights.insert(frame.lights.end(), sky.begin(), sky.end());
    const RenderPlan plan = plan_frame(frame, {}, scene_bounds(*frame.scene), true);
    EXPECT_EQ(plan.soft_lights, soft);
    EXPECT_EQ(plan.lights.size() + plan.soft_lights + plan.lights_skipped, frame.lights.size());
    if (count == 4) {
      EXPECT_EQ(plan.lights_skipped, 0u);
    }
  }
}

// From all around it falls on the scene, and nowhere where none of that is seen.
TEST(SoftShadow, FallsOnTheSceneAlone) {
  Yard yard(64, 36, false);
  const auto plan = [&] { return plan_frame(yard.frame, {}, scene_bounds(*yard.scene), true); };
  EXPECT_FALSE(plan().shadow.empty());
  yard.frame.viewport = synthetic::look_at({0.0, 5.0, 0.0}, {1.0, 9.0, 0.0}, 64, 36, 50.0);
  EXPECT_GT(plan().soft_lights, 0u);
  EXPECT_TRUE(plan().untouched());
}

// In one it is what each light's for itself is, and the other renderer's.
TEST(SoftShadow, IsThatOfItsLights) {
  Yard yard(640, 360, false);
  ProcessorRenderer renderer;
  const Picture together = yard.composite(renderer, {});
  yard.frame.soft_light.reset();
  const double alike = synthetic::psnr(together, yard.composite(renderer, {}));
  std::printf("together and each for itself: %.1f dB\n", alike);
  EXPECT_GT(alike, 42.0);
  polyhull::testing::HeadlessContext context(false);
  if (!context.ready()) GTEST_SKIP() << context.why();
  Compositor compositor;
  const double other = synthetic::psnr(together, yard.composite(compositor, {}));
  std::printf("OpenGL and the processor: %.1f dB\n", other);
  EXPECT_GT(other, 42.0);
}

}  // namespace
}  // namespace polyhull::processor
