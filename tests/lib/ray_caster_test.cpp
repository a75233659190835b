// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/ray_caster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "base/error.h"

namespace polyhull {
namespace {

struct Mesh {
  std::vector<Vec3f> positions;
  std::vector<std::uint32_t> triangles;
};

Mesh random_triangles(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-1.0f, 1.0f);
  Mesh mesh;
  for (int i = 0; i < count; ++i) {
    const Vec3f centre(place(random), place(random), place(random));
    for (int k = 0; k < 3; ++k) {
      mesh.triangles.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
      mesh.positions.push_back(centre + 0.3f * Vec3f(place(random), place(random), place(random)));
    }
  }
  return mesh;
}

/// Nearest hit by brute force in double precision, infinity for none.
double brute_force(const Mesh& mesh, const Ray& ray) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const Vec3 a(mesh.positions[mesh.triangles[i]]), b(mesh.positions[mesh.triangles[i + 1]]),
        c(mesh.positions[mesh.triangles[i + 2]]);
    const Mat3 m(b - a, c - a, -Vec3(ray.direction));
    if (glm::determinant(m) == 0.0) continue;
    const Vec3 x = glm::inverse(m) * (Vec3(ray.origin) - a);
    if (x.x >= 0 && x.y >= 0 && x.x + x.y <= 1 && x.z >= ray.near && x.z <= ray.far) {
      nearest = std::min(nearest, x.z);
    }
  }
  return nearest;
}

TEST(RayCaster, AgreesWithBruteForce) {
  const Mesh mesh = random_triangles(60, 1);
  RayCaster caster;
  const std::uint32_t id = caster.add_mesh(mesh.positions, mesh.triangles);
  caster.commit();
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  std::vector<Ray> rays;
  for (int i = 0; i < 1003; ++i) {
    Ray ray;
    ray.origin = 2.0f * Vec3f(normal(random), normal(random), normal(random));
    ray.direction = 0.7f * Vec3f(normal(random), normal(random), normal(random)) - ray.origin;
    rays.push_back(ray);
  }
  std::vector<RayHit> hits(rays.size());
  std::vector<std::uint8_t> blocked(rays.size());
  caster.intersect(rays, hits);
  caster.occluded(rays, blocked, false);
  int met = 0, wrong = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double expected = brute_force(mesh, rays[i]);
    const RayHit one = caster.intersect(rays[i]);
    if (one.hit() != std::isfinite(expected)) ++wrong;  // a ray within rounding of an edge
    EXPECT_EQ(one.hit(), hits[i].hit());
    EXPECT_EQ(one.hit(), caster.occluded(rays[i]));
    EXPECT_EQ(one.hit(), blocked[i] != 0);
    if (!one.hit() || !std::isfinite(expected)) continue;
    ++met;
    EXPECT_NEAR(one.distance, expected, 1e-4);
    EXPECT_NEAR(hits[i].distance, expected, 1e-4);
    ASSERT_EQ(one.mesh, id);
    const std::uint32_t* t = &mesh.triangles[3 * one.triangle];
    const Vec3f p0 = mesh.positions[t[0]], p1 = mesh.positions[t[1]], p2 = mesh.positions[t[2]];
    const Vec3f by_barycentrics = (1 - one.u - one.v) * p0 + one.u * p1 + one.v * p2;
    const Vec3f by_distance = rays[i].origin + one.distance * rays[i].direction;
    EXPECT_LT(glm::length(by_barycentrics - by_distance), 1e-4f);
    EXPECT_GT(glm::dot(one.normal, glm::cross(p1 - p0, p2 - p0)), 0.0f);
  }
  EXPECT_GT(met, 200);
  EXPECT_LE(wrong, 1);
}

TEST(RayCaster, MeshesMoveComeAndGo) {
  RayCaster caster;
  const std::vector<Vec3f> square = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}};
  const std::vector<std::uint32_t> triangles = {0, 1, 2, 0, 2, 3};
  const std::uint32_t id = caster.add_mesh(square, triangles);
  const std::uint32_t empty = caster.add_mesh({}, {});
  caster.commit();
  EXPECT_NE(id, empty);
  const Ray ray;
  EXPECT_FLOAT_EQ(caster.intersect(ray).distance, 2.0f);
  std::vector<Vec3f> moved = square;
  for (Vec3f& p : moved) p.z = 5.0f;
  caster.move_mesh(id, moved);
  caster.commit();
  EXPECT_FLOAT_EQ(caster.intersect(ray).distance, 5.0f);
  Ray short_ray = ray;
  short_ray.far = 4.0f;
  EXPECT_FALSE(caster.occluded(short_ray));
  EXPECT_THROW(caster.move_mesh(id, std::span<const Vec3f>(moved).first(3)), Error);
  caster.remove_mesh(id);
  caster.commit();
  EXPECT_FALSE(caster.intersect(ray).hit());
}

TEST(RayCaster, RefusesIndicesBeyondTheVertices) {
  RayCaster caster;
  const std::vector<Vec3f> positions(3);
  const std::vector<std::uint32_t> triangles = {0, 1, 3};
  EXPECT_THROW(caster.add_mesh(positions, triangles), Error);
}

}  // namespace
}  // namespace polyhull
