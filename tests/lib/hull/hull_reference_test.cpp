// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder against exact references on small scenes: its vertices are those that brute force in
// rational numbers finds. hull_cgal_test compares volumes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "hull/build/hull_builder.h"
#include "support/degenerate_scenes.h"
#include "support/hull_expectations.h"
#include "support/rational_hull.h"

namespace polyhull::test {
namespace {

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

TEST(HullTruth, BruteForceFindsTheCornersOfABox) {
  const Bounds box{Vec3(-1), Vec3(1)};
  EXPECT_EQ(rational_hull({}, box).vertices.size(), 8u);
}

TEST(HullTruth, RationalAndFilteredMembershipAgree) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const HullScene scene = tiny_scene(seed);
    const auto views = scene.views();
    HullOptions options;
    options.bounds = scene.rig.bounds;
    const SilhouetteMembership truth(views, options);
    Dice dice(seed + 1000);
    for (int i = 0; i < 200; ++i) {
      const Vec3 X(dice.between(-1.5, 1.5), dice.between(-1.5, 1.5), dice.between(-1.5, 1.5));
      const Place place = rational_place(views, options.bounds, X);
      ASSERT_EQ(truth.ask(X) == SilhouetteMembership::inside, place == Place::inside) << scene.name;
    }
  }
}

}  // namespace
}  // namespace polyhull::test
