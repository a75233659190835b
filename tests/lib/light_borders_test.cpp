// SPDX-License-Identifier: LGPL-2.1-or-later
// Sharp shadows in the light cache: straight, and of light that a mirror throws.
#include <gtest/gtest.h>

#include <cmath>

#include "builtin/shapes.h"
#include "raytrace/light_cache.h"
#include "view/raster_view.h"

namespace polyhull {
namespace {

/// A floor, a plate above it, a mirror that stands on it, and a lamp of no size.
Scene sharp_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.materials[1].metallic = 1.0f;
  scene.materials[1].roughness = 0.0f;
  scene.materials[1].base_colour = Vec3f(0.9f);
  scene.meshes = {
      parallelogram("floor", 0, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4}),
      parallelogram("plate", 0, {-0.21f, 0.5f, 0.33f}, {0.5f, 0, 0.07f}, {0.08f, 0, -0.4f}),
      parallelogram("mirror", 1, {-0.7f, 0.2f, -1.5f}, {1.3f, 0, 0}, {0, 0.9f, 0})};
  Light lamp;
  lamp.centre = {0.3f, 2.0f, 0.2f};
  lamp.radiance = Vec3f(10.0f);
  scene.lights = {lamp};
  scene.mirrors = find_mirrors(scene);
  return scene;
}

/// Straight and mirrored light at a place of the floor, without a bounce.
Vec3f light_at(const TracedScene& scene, const Vec3f& place) {
  const Vec3f up(0, 1, 0), origin = place + scene.epsilon() * up;
  Vec3f sum = light_sample(scene, scene.scene().lights[0], {0.5f, 0.5f}, origin, up);
  for (const MirroredLight& light : scene.mirrored_lights())
    sum += mirrored_light_sample(scene, light, {0.5f, 0.5f}, origin, up);
  return sum;
}

/// Where the floor is hit.
RayHit floor_at(const TracedScene& scene, const Vec3f& place) {
  Ray ray;
  ray.origin = place + Vec3f(0, 0.05f, 0);
  ray.direction = {0, -1, 0};
  return scene.caster().intersect(ray);
}

struct Differences {
  int places = 0, wrong = 0;
};

/// Places near, but not at a border of light where the cache is off by more than a tenth of \p jump.
Differences near_borders(const LightCache& light, const TracedScene& scene, float jump) {
  Differences out;
  for (float x = -1.9f; x < 1.9f; x += 0.0137f) {
    for (float z = -1.4f; z < 1.9f; z += 0.0171f) {
      const Vec3f place(x, 0, z);
      const float expected = light_at(scene, place).x;
      bool near = false, at = false;
      for (const Vec3f& step : {Vec3f(1, 0, 0), Vec3f(-1, 0, 0), Vec3f(0, 0, 1), Vec3f(0, 0, -1)}) {
        near |= std::abs(light_at(scene, place + 0.02f * step).x - expected) > jump;
        at |= std::abs(light_at(scene, place + 0.007f * step).x - expected) > jump;
      }
      if (!near || at) continue;
      ++out.places;
      const float found = light.irradiance(floor_at(scene, place), false).x;
      out.wrong += std::abs(found - expected) > 0.1f * jump + 0.12f;  // and what bounces
    }
  }
  return out;
}

TEST(LightBorders, AreSharperThanACell) {
  const TracedScene scene(sharp_scene());
  ASSERT_EQ(scene.mirrored_lights().size(), 1u);
  LightCacheOptions options;
  options.bounce_samples = 16;
  const LightCache light(scene, options);
  const Differences with = near_borders(light, scene, 0.5f);
  EXPECT_GT(with.places, 300);
  EXPECT_LT(with.wrong, with.places / 50);
  options.borders = false;
  const Differences without = near_borders(LightCache(scene, options), scene, 0.5f);
  EXPECT_GT(without.wrong, without.places / 4) << "the test sees nothing";
}

TEST(LightBorders, RasterisedAndByRays) {
  const TracedScene scene(sharp_scene());
  LightCacheOptions options;
  options.bounce_samples = 16;
  options.spacing = 0.06f;  // large in the picture
  const LightCache light(scene, options);
  const Camera camera = look_at({0.4, 1.2, 1.2}, {0.1, 0, -0.2}, 50, 160, 120);
  std::vector<Vec3f> raster(160 * 120), rays(160 * 120);
  ViewOptions view;
  RasterView(scene, light).draw(camera, view, raster);
  view.contrast = 1.0f;  // one ray a pixel, where the rasteriser looks up, too
  render_view(scene, light, camera, view, rays);
  int off = 0;
  for (std::size_t i = 0; i < raster.size(); ++i)
    off += glm::length(glm::min(raster[i], 1.0f) - glm::min(rays[i], 1.0f)) > 0.004f;
  EXPECT_LT(off, 500) << "only the plate's and the mirror's outlines";
}

}  // namespace
}  // namespace polyhull
