// SPDX-License-Identifier: LGPL-2.1-or-later
// HullBuilder against CGAL's booleans with exact constructions on small scenes, and both references
// against each other. Built with -Dbenchmarks=true.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hull/build/hull_builder.h"
#include "support/cgal_hull.h"
#include "support/cgal_self_intersections.h"
#include "support/degenerate_scenes.h"
#include "support/hull_expectations.h"
#include "support/rational_hull.h"

namespace polyhull::test {
namespace {

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

TEST(HullReference, SimplificationMakesNoTrianglesCross) {
  HullBuilder builder;
  const auto compare = [&](const HullScene& scene, HullOptions options) {
    const auto views = scene.views();
    const std::size_t before = count_self_intersections(builder.build(views, options));
    const double size = glm::length(scene.rig.bounds->max - scene.rig.bounds->min);
    for (double relative : {1e-5, 1e-4, 1e-3, 1e-2}) {
      options.max_deviation = relative * size;
      const Hull& hull = builder.build(views, options);
      EXPECT_TRUE(check_mesh(hull).sound()) << scene.name << ": " << check_mesh(hull).describe();
      EXPECT_LE(count_self_intersections(hull), before) << scene.name << ", " << relative;
    }
  };
  compare(figure_scene(4, 6), {});
  compare(figure_scene(9, 10, 0.7), {});
  compare(knot_scene(5, 8), {});
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const HullScene scene = random_scene(seed);
    compare(scene, within(scene));
  }
}

}  // namespace
}  // namespace polyhull::test
