// SPDX-License-Identifier: LGPL-2.1-or-later
// An environment's shadow, drawn in one, against very many rays: the share of its light that subjects take.
#include "render/processor/soft_shadow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
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

  Stage(const RadiancePicture& around, ShadowQuality quality, int width, int height) {
    scene->meshes.erase(scene->meshes.begin() + 2, scene->meshes.begin() + 4);
    scene->lights.clear();
    scene->environment = std::make_shared<const Environment>(around, 20.0, "around");
    traced = std::make_unique<TracedScene>(*scene);
    mesh.hull = synthetic::figure(20);
    frame.width = width;
    frame.height = height;
    frame.viewport = synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.7, 0.0}, width, height, 50.0);
    frame.scene = scene;
    const std::size_t count = quality == ShadowQuality::best ? 32 : 16;
    frame.lights = environment_lights(*scene, count);
    frame.sky = Vec3f(1.0f);
    frame.soft_light = std::make_shared<const std::vector<EnvironmentPart>>(
        scene->environment->soft_parts(count, 32 * count));
    frame.subjects.push_back({&mesh, {}, 1});
    settings.shadow = quality;
    plan = plan_frame(frame, settings, scene_bounds(*scene));
    join_soft_lights(frame, settings, plan);
    layer.set(traced.get(), {pixels_from_scene(frame.viewport), width, height, 4, {}});
    layer.ensure_middles({0, 0, width, height});
  }
  RenderSettings settings;
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
      const ShadowRecipe recipe = shadow_recipe(settings, light, planned.share);
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
    double good, best;  // RMS; at the edge of a sun's shadow the grid of that is too coarse
  } pictures[] = {{"a sky with a sun", test::outdoors(64), 0.013, 0.0115},
                  {"overcast", overcast(), 0.01, 0.0075},
                  {"softboxes", softboxes(), 0.01, 0.0065}};
  for (const auto& [name, picture, good_bar, best_bar] : pictures)
    for (const ShadowQuality quality : {ShadowQuality::good, ShadowQuality::best}) {
      const bool best = quality == ShadowQuality::best;
      const Stage stage(picture, quality, 1280, 720);
      const Errors found = errors(stage, 37, 1024);
      std::printf("%s, %s: RMS %.4f, bias %+.4f, 99 %% below %.4f, of %d pixels; %zu suns\n", name,
                  best ? "best" : "good", found.rms, found.bias, found.p99, found.pixels,
                  stage.plan.lights.size());
      EXPECT_GT(found.pixels, 300);
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
    ProcessorRenderer fresh;
    set_pool_threads(i % 2 ? 1 : 0);
    EXPECT_TRUE(found.pixels == yard.composite(fresh, all).pixels) << i;
    set_pool_threads(0);
    EXPECT_LT(synthetic::psnr(found, yard.background), 30.0) << "there is something to be seen";
  }
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
