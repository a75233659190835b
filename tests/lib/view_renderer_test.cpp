// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/view_renderer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "builtin/room.h"
#include "builtin/shapes.h"
#include "raytrace/area_light.h"
#include "raytrace/path_tracer.h"
#include "support/picture_error.h"
#include "support/quick_light.h"

namespace polyhull {
namespace {

std::vector<Vec3f> view_of(const TracedScene& scene, const LightCache& cache, const Camera& camera,
                           const ViewOptions& options = {}) {
  std::vector<Vec3f> picture(static_cast<std::size_t>(camera.width) * camera.height);
  render_view(scene, cache, camera, options, picture);
  return picture;
}

/// A floor, a lamp and a thin wall standing on the floor between them.
Scene wall_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[0].base_colour = Vec3f(0.5f);
  scene.meshes = {parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
                  box("wall", 1, {0.0f, 0.0f, -1.0f}, {0.02f, 0.8f, 1.0f})};
  Light lamp;
  lamp.centre = {-1.5f, 2.0f, 0.0f};
  lamp.u = {0.2f, 0, 0};
  lamp.v = {0, 0, 0.3f};
  lamp.radiance = Vec3f(20.0f);
  scene.lights = {lamp};
  return scene;
}

RayHit below(const TracedScene& scene, const Vec3f& point) {
  Ray ray;
  ray.origin = point + Vec3f(0, 0.001f, 0);
  ray.direction = {0, -1, 0};
  return scene.caster().intersect(ray);
}

TEST(LightCache, IsTheClosedFormInTheOpenAndDarkInTheShadow) {
  Scene scene = wall_scene();
  scene.materials[0].base_colour = scene.materials[1].base_colour = Vec3f(0.0f);  // no bounce
  const TracedScene traced(scene);
  LightCacheOptions options = synthetic::quick_light(64);
  options.spacing = 0.02f;
  const LightCache cache(traced, options);
  for (const Vec3f& p :
       {Vec3f(-1, 0, 0.3f), Vec3f(-0.3f, 0, -0.7f), Vec3f(1.9f, 0, 0), Vec3f(1, 0, 1.9f)}) {
    const float expected = 20.0f * unoccluded_irradiance(scene.lights[0], p, {0, 1, 0});
    EXPECT_NEAR(cache.irradiance(below(traced, p), false).x, expected, 2e-3f * expected) << p.x;
  }
  EXPECT_EQ(cache.irradiance(below(traced, {0.3f, 0, 0}), false).x, 0.0f);
  // Beside the foot of the wall on the lit side: no dark rim from the nodes inside the wall.
  const Vec3f foot(-0.004f, 0, 0);
  const float expected = 20.0f * unoccluded_irradiance(scene.lights[0], foot, {0, 1, 0});
  EXPECT_GT(cache.irradiance(below(traced, foot), false).x, 0.9f * expected);
}

TEST(LightCache, SoftShadowIsThePathTracers) {
  const TracedScene traced(wall_scene());
  LightCacheOptions options = synthetic::quick_light(64);
  options.spacing = 0.02f;
  const LightCache cache(traced, options);
  const Camera camera = look_at({1.2, 2.5, 0.9}, {0.9, 0, 0}, 50, 96, 64);
  const Picture fast = develop(view_of(traced, cache, camera), 1.0f, 96, 64);
  PathOptions paths;
  paths.light_samples = 4;
  EXPECT_GT(synthetic::psnr(fast, trace_picture(traced, camera, 64, paths)), 44.0);
}

TEST(LightCache, BrighterLampsScaleIt) {
  Scene scene = wall_scene();
  const TracedScene traced(scene);
  LightCache cache(traced, synthetic::quick_light(64));
  cache.set_gain({2.0f, 1.0f, 0.5f});
  scene.lights[0].radiance *= Vec3f(2.0f, 1.0f, 0.5f);
  const TracedScene brighter(scene);
  const LightCache expected(brighter, synthetic::quick_light(64));
  for (float x = -1.9f; x < 2.0f; x += 0.31f) {
    const RayHit hit = below(traced, {x, 0, 0.2f});
    EXPECT_LT(glm::length(cache.irradiance(hit, false) - expected.irradiance(hit, false)), 1e-4f);
  }
  EXPECT_LT(glm::length(cache.mean_bounced() - expected.mean_bounced()), 1e-4f);
}

TEST(LightCache, BothSidesOfADoubleSidedSheet) {
  Scene scene = wall_scene();
  scene.materials[1].double_sided = true;
  scene.meshes[1] = parallelogram("sheet", 1, {-2, 1, 2}, {4, 0, 0}, {0, 0, -4});
  const TracedScene traced(scene);
  const LightCache cache(traced, synthetic::quick_light(64));
  RayHit hit;
  hit.mesh = 1;
  hit.triangle = 0;
  hit.u = hit.v = 0.3f;
  EXPECT_GT(cache.irradiance(hit, false).x, 0.1f);
  EXPECT_LT(cache.irradiance(hit, true).x, 0.05f);
}

class RoomView : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    traced = new TracedScene(room_scene());
    cache = new LightCache(*traced, synthetic::quick_light(64));
  }
  static void TearDownTestSuite() {
    delete cache;
    delete traced;
  }
  static TracedScene* traced;
  static LightCache* cache;
};
TracedScene* RoomView::traced = nullptr;
LightCache* RoomView::cache = nullptr;

TEST_F(RoomView, IsNearTheTruth) {
  // Even with a coarse cache; the defaults do better (docs/elements/scenesrc.md).
  for (const double degrees : {20.0, 250.0}) {
    const double a = degrees * 0.017453292519943295;
    const Camera camera =
        look_at({2.7 * std::sin(a), 1.5, 2.7 * std::cos(a)}, {0, 1, 0}, 52, 96, 54);
    const Picture fast = develop(view_of(*traced, *cache, camera), 1.0f, 96, 54);
    PathOptions paths;
    paths.light_samples = 4;
    paths.bounce_samples = 4;
    EXPECT_GT(synthetic::psnr(fast, trace_picture(*traced, camera, 32, paths)), 36.0) << degrees;
  }
}

TEST_F(RoomView, SameOnOneThreadAndOnMany) {
  const Camera camera = look_at({1.2, 1.5, 2.4}, {0, 1, 0}, 55, 97, 51);
  ViewOptions one;
  one.threads = 1;
  EXPECT_EQ(view_of(*traced, *cache, camera, one), view_of(*traced, *cache, camera));
  LightCacheOptions options = synthetic::quick_light(64);
  options.spacing = 0.2f;
  options.bounce_spacing = 0.5f;
  const LightCache many(*traced, options);
  options.threads = 1;
  const LightCache single(*traced, options);
  EXPECT_EQ(view_of(*traced, many, camera), view_of(*traced, single, camera));
}

TEST_F(RoomView, DoesNotFlickerWhenTheCameraMovesALittle) {
  // A tenth of a pixel on: no pixel may jump, as noise would.
  const auto at = [&](double x) {
    const Camera camera = look_at({1.2 + x, 1.5, 2.4}, {x, 1, 0}, 55, 160, 90);
    return develop(view_of(*traced, *cache, camera), 1.0f, 160, 90);
  };
  EXPECT_GT(synthetic::psnr(at(0.0), at(0.0005)), 40.0);
}

TEST_F(RoomView, OddSizesAndLensesWork) {
  Camera camera = look_at({1.2, 1.5, 2.4}, {0, 1, 0}, 55, 1, 1);
  EXPECT_TRUE(std::isfinite(view_of(*traced, *cache, camera)[0].x));
  camera = look_at({1.2, 1.5, 2.4}, {0, 1, 0}, 55, 33, 17);
  camera.distortion = {-0.1, 0.01, 0, 0};
  for (const Vec3f& value : view_of(*traced, *cache, camera)) {
    EXPECT_TRUE(std::isfinite(value.x + value.y + value.z));
  }
  // Outside the room nothing is black by accident: the walls have both sides, lit or not.
  camera = look_at({30, 20, 40}, {0, 1, 0}, 5, 33, 17);
  for (const Vec3f& value : view_of(*traced, *cache, camera)) {
    EXPECT_TRUE(std::isfinite(value.x + value.y + value.z));
  }
}

}  // namespace
}  // namespace polyhull
