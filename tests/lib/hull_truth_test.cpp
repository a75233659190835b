// SPDX-License-Identifier: LGPL-2.1-or-later
// The references that hulls are held against must agree with each other: brute force in rational
// numbers, CGAL's booleans with exact constructions, and the silhouettes themselves.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/cgal_hull.h"
#include "support/degenerate_scenes.h"
#include "support/membership.h"
#include "support/rational_hull.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

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

TEST(HullTruth, BruteForceAndExactBooleansAgree) {
  std::size_t compared = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const HullScene scene = tiny_scene(seed);
    const auto views = scene.views();
    const RationalHull brute = rational_hull(views, scene.rig.bounds);
    const CgalHull cgal = cgal_hull_exact(views, scene.rig.bounds, 0.25, 16.0);
    if (!brute.general_position || !cgal.done) continue;
    ++compared;
    // CGAL also keeps the points where its faces' diagonals are cut: each of ours must be one of
    // its.
    for (const Vec3& v : brute.vertices) {
      double nearest = 1e9;
      for (const Vec3& w : cgal.vertices) nearest = std::min(nearest, glm::length(v - w));
      EXPECT_LT(nearest, 1e-12) << scene.name;
    }
    EXPECT_EQ(brute.vertices.empty(), cgal.vertices.empty());
    Hull mesh;
    for (const Vec3& v : cgal.vertices) mesh.vertices.emplace_back(v);
    for (const auto& t : cgal.triangles)
      mesh.triangles.insert(mesh.triangles.end(), t.begin(), t.end());
    HullOptions options;
    options.bounds = scene.rig.bounds;
    const auto report = compare_membership(mesh, views, options, *scene.rig.bounds, 20000, seed);
    EXPECT_EQ(report.wrong(), 0u) << scene.name << " by " << report.worst_distance;
  }
  EXPECT_GE(compared, 8u);
}

}  // namespace
}  // namespace polyhull::test
