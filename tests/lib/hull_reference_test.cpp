// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder against exact references on small scenes: its vertices are those that brute force in
// rational numbers finds, its volume is that of CGAL's booleans with exact constructions, and
// points lie where exact arithmetic puts them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "support/cgal_hull.h"
#include "support/degenerate_scenes.h"
#include "support/hull_expectations.h"
#include "support/rational_hull.h"

namespace polyhull::test {
namespace {

HullOptions within(const HullScene& scene) {
  HullOptions options;
  options.bounds = scene.rig.bounds;
  return options;
}

/// Counts grow with POLYHULL_STRESS, as in tests/stress.
std::uint64_t scaled(std::uint64_t count) {
  const char* text = std::getenv("POLYHULL_STRESS");
  return text ? count * std::strtoull(text, nullptr, 10) : count;
}

/// The greatest distance of a point of \p from to the nearest of \p to.
double worst_distance(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
  double worst = 0.0;
  for (const Vec3& p : from) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& q : to) nearest = std::min(nearest, glm::length(p - q));
    worst = std::max(worst, nearest);
  }
  return worst;
}

std::vector<Vec3> world_vertices(const Hull& hull) {
  std::vector<Vec3> vertices;
  for (const Vec3f& v : hull.vertices) vertices.push_back(hull.origin + Vec3(v));
  return vertices;
}

TEST(HullReference, VerticesAreThoseOfBruteForce) {
  HullBuilder builder;
  std::size_t compared = 0, full = 0;
  for (std::uint64_t seed = 0; seed < scaled(60); ++seed) {
    const HullScene scene = tiny_scene(seed);
    const auto views = scene.views();
    const RationalHull truth = rational_hull(views, scene.rig.bounds);
    if (!truth.general_position) continue;
    ++compared;
    const Hull& hull = builder.build(views, within(scene));
    EXPECT_EQ(hull.vertices.size(), truth.vertices.size()) << scene.name;
    if (truth.vertices.empty()) continue;
    ++full;
    const auto vertices = world_vertices(hull);
    EXPECT_LE(worst_distance(vertices, truth.vertices), 4 * rounding_of(hull)) << scene.name;
    EXPECT_LE(worst_distance(truth.vertices, vertices), 4 * rounding_of(hull)) << scene.name;
    expect_right(hull, views, within(scene), scene.name, {.points = 2000, .seed = seed});
  }
  EXPECT_GE(compared, scaled(58));
  EXPECT_GE(full, scaled(36));
}

TEST(HullReference, WithoutBoundsToo) {
  HullBuilder builder;
  std::size_t compared = 0;
  for (std::uint64_t seed = 1000; seed < 1000 + scaled(25); ++seed) {
    const HullScene scene = tiny_scene(seed);
    const auto views = scene.views();
    const RationalHull truth = rational_hull(views, std::nullopt);
    const Hull& hull = builder.build(views);
    EXPECT_TRUE(check_mesh(hull).sound()) << scene.name << ": " << check_mesh(hull).describe();
    // Two cameras that look the same way may share a cone without end: nothing to compare then.
    if (!truth.general_position || hull.vertices.size() != truth.vertices.size()) continue;
    ++compared;
    EXPECT_LE(worst_distance(world_vertices(hull), truth.vertices), 4 * rounding_of(hull))
        << scene.name;
  }
  EXPECT_GE(compared, scaled(15));
}

TEST(HullReference, VolumeIsThatOfExactBooleans) {
  HullBuilder builder;
  std::size_t compared = 0;
  const auto compare = [&](const HullScene& scene) {
    const auto views = scene.views();
    const CgalHull truth = cgal_hull_exact(views, scene.rig.bounds, 0.25, 16.0);
    if (!truth.done) return;
    const Hull& hull = builder.build(views, within(scene));
    const MeshReport mesh = check_mesh(hull);
    EXPECT_TRUE(mesh.sound()) << scene.name << ": " << mesh.describe();
    const double size = std::pow(glm::length(scene.rig.bounds->max - scene.rig.bounds->min), 3);
    EXPECT_NEAR(mesh.volume, truth.volume, 1e-6 * truth.volume + 1e-12 * size) << scene.name;
    ++compared;
  };
  for (std::uint64_t seed = 0; seed < 25; ++seed) compare(tiny_scene(seed));
  compare(figure_scene(3, 40));
  compare(figure_scene(4, 48, 1.0));
  EXPECT_GE(compared, 20u);
}

TEST(HullReference, DegenerateVolumeIsThatOfExactBooleans) {
  HullBuilder builder;
  std::size_t compared = 0;
  for (const DegenerateScene& degenerate : degenerate_scenes()) {
    const HullScene& scene = degenerate.scene;
    if (!degenerate.simple || scene.contour_vertices() > 60 || !scene.rig.bounds) continue;
    if (std::any_of(scene.silhouettes.begin(), scene.silhouettes.end(),
                    [](const Rings& r) { return r.empty(); })) {
      continue;
    }
    double farthest = 0.0;
    for (const Camera& camera : scene.rig.cameras) {
      for (const Vec3& corner : corners_of(*scene.rig.bounds)) {
        farthest = std::max(farthest, camera.to_camera(corner).z);
      }
    }
    const auto views = scene.views();
    const CgalHull truth =
        cgal_hull_exact(views, scene.rig.bounds, farthest * 0x1p-30, farthest * 2);
    const Hull& hull = builder.build(views, within(scene));
    const MeshReport mesh = check_mesh(hull);
    EXPECT_TRUE(mesh.sound()) << scene.name << ": " << mesh.describe();
    if (!truth.done) continue;  // CGAL refuses results that touch themselves
    ++compared;
    const double size = std::pow(glm::length(scene.rig.bounds->max - scene.rig.bounds->min), 3);
    EXPECT_NEAR(mesh.volume, truth.volume, 1e-6 * truth.volume + 1e-9 * size) << scene.name;
  }
  EXPECT_GE(compared, 25u);
}

}  // namespace
}  // namespace polyhull::test
