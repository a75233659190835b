// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/light_reach.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "synthetic.h"

namespace polyhull::processor {
namespace {

/// Whether the segment p-q meets the triangle (Moeller and Trumbore).
bool meets(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 d = q - p, e1 = b - a, e2 = c - a, h = glm::cross(d, e2), s = p - a;
  const double det = glm::dot(e1, h);
  if (det == 0.0) return false;
  const Vec3 r = glm::cross(s, e1);
  const double u = glm::dot(s, h) / det, v = glm::dot(d, r) / det, w = glm::dot(e2, r) / det;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && w > 0.0 && w < 1.0;
}

// Where any ray to the lamp is blocked it must not say "no"; and it does say "no" for most of what
// no ray finds blocked.
TEST(LightReach, ItsNoIsCertain) {
  Hull hull;
  synthetic::add_box(hull, {-0.2f, 0.6f, -0.1f}, {0.25f, 1.0f, 0.15f});
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  for (const float size : {0.0f, 0.1f, 0.6f}) {
    Light lamp;
    lamp.centre = {0.3f, 2.2f, 0.2f};
    lamp.radiance = Vec3f(1.0f);
    lamp.u = {size, 0.0f, 0.2f * size};
    lamp.v = {0.2f * size, 0.0f, -size};  // u x v looks down
    if (size > 0.0f && glm::cross(lamp.u, lamp.v).y > 0.0f) lamp.v = -lamp.v;
    LightReach reach;
    reach.build(lamp, hull.vertices, hull.triangles);
    int blocked_places = 0, free_places = 0, spared = 0;
    for (int i = 0; i < 3000; ++i) {
      const Vec3f place(1.8f * unit(random), 0.25f * (1.0f + unit(random)), 1.8f * unit(random));
      bool blocked = false;
      for (int k = 0; k < 60 && !blocked; ++k) {
        const Vec3f to = lamp.centre + unit(random) * lamp.u + unit(random) * lamp.v;
        for (std::size_t f = 0; f + 2 < hull.triangles.size() && !blocked; f += 3)
          blocked = meets(Vec3(place), Vec3(to), Vec3(hull.vertices[hull.triangles[f]]),
                          Vec3(hull.vertices[hull.triangles[f + 1]]),
                          Vec3(hull.vertices[hull.triangles[f + 2]]));
      }
      LightReach::Extent extent;
      reach.add(place, extent);
      const bool may = reach.may_shade(extent);
      if (blocked) {
        EXPECT_TRUE(may) << "lamp of " << size << " m, place " << place.x << " " << place.y << " "
                         << place.z;
      }
      blocked_places += blocked;
      free_places += !blocked;
      spared += !may;
    }
    EXPECT_GT(blocked_places, 50);
    EXPECT_GT(spared, 7 * free_places / 10) << "lamp of " << size << " m";
  }
}

}  // namespace
}  // namespace polyhull::processor
