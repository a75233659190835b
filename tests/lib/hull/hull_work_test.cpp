// SPDX-License-Identifier: LGPL-2.1-or-later
// How much work fine contours make, by counters and never by the clock: contours may come from
// anywhere, and must not keep a hull busy with the square of their vertices.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "hull/build/hull_builder.h"
#include "hull/cones/cone.h"
#include "hull/hull.h"
#include "hull/surface/patch_optimizer.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

/// A regular polygon of \p n vertices around the pixel (0, 0), where floats are finest.
Rings polygon(int n, double radius) {
  std::vector<Vec2f> points;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.25) / n;
    points.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  Rings rings;
  add_ring(rings, points);
  return rings;
}

/// Cameras that see the world's origin in the pixel (0, 0).
Rig cameras_at_corner(int count) {
  Rig rig = ring_of_cameras(count);
  for (Camera& camera : rig.cameras) camera.K[2][0] = camera.K[2][1] = 0.0;
  return rig;
}

TEST(HullWork, GridAndChecksOfTinyContoursGrowWithTheirVertices) {
  const Rig rig = cameras_at_corner(2);
  const hull::ConeCamera camera = hull::read_camera(rig.cameras[0], 0);
  const hull::Lattice lattice{Vec3(0.0), 0x1p30};
  for (const double radius : {0.001, 0.005, 0.01, 0.1, 1.0})
    for (const int n : {500, 1000, 2000}) {
      const Rings rings = polygon(n, radius);
      const Silhouette silhouette{&rig.cameras[0], &rings};
      const hull::ConeInput input{&silhouette, &camera, 0};
      hull::Cone cone;
      hull::build_cone(cone, {&input, 1}, lattice, Unseen::carve);
      ASSERT_EQ(cone.size(), n) << "left as it is";
      std::size_t entries = 0;
      for (int row = 0; row < cone.grid.rows(); ++row)
        for (int column = 0; column < cone.grid.columns(); ++column)
          entries += cone.grid.edges(column, row).size();
      EXPECT_LT(entries, 6u * n) << "cells of an edge, radius " << radius;
      EXPECT_LT(cone.compared_pairs, 30u * n) << "radius " << radius;
    }
}

TEST(HullWork, FacesOfTinyContoursAreFoundByTheGrid) {
  // Of 1,000 edges in each of three other cameras.
  for (const auto& [radius, most] : {std::pair{0.01, 1500u}, {0.1, 350u}, {1.0, 350u}}) {
    HullScene scene;
    scene.rig = cameras_at_corner(4);
    scene.silhouettes.assign(4, polygon(1000, radius));
    HullBuilder builder;
    const Hull& hull = builder.build(scene.views());
    EXPECT_TRUE(check_mesh(hull).sound()) << check_mesh(hull).describe();
    EXPECT_LT(builder.statistics().predicates / 4000, most) << "radius " << radius;
  }
}

TEST(HullWork, PatchesOfLargeFacesAreMendedWhereTheyAre) {
  // Triangles between two rows of points, joined so that most are slivers.
  for (const int n : {1000, 10000}) {
    std::vector<Vec3> points;
    std::vector<hull::CornerKey> keys;
    for (int i = 0; i < n; ++i)
      for (const double y : {0.0, 0.01}) {
        points.emplace_back(i, y, 0.0);
        const std::uint32_t plane = 3u * static_cast<std::uint32_t>(keys.size());
        keys.push_back({plane, plane + 1, plane + 2});
      }
    // In groups of 10, all of the lower row from one corner above, then all of the upper row.
    std::vector<std::uint32_t> triangles;
    const auto below = [](int i) { return 2u * i; };
    const auto above = [](int i) { return 2u * i + 1; };
    for (int group = 0; group + 1 < n; group += 10) {
      const int end = std::min(group + 10, n - 1);
      for (int i = group; i < end; ++i)
        triangles.insert(triangles.end(), {below(i), below(i + 1), above(group)});
      for (int i = group; i < end; ++i)
        triangles.insert(triangles.end(), {above(i), below(end), above(i + 1)});
    }
    hull::PatchOptimizer optimizer;
    const auto bad = [&] {
      std::size_t count = 0;
      for (std::size_t t = 0; t < triangles.size(); t += 3)
        count += hull::shape_of(points[triangles[t]], points[triangles[t + 1]],
                                points[triangles[t + 2]], Vec3(0, 0, 1)) != hull::Shape::good;
      return count;
    };
    EXPECT_GT(bad(), triangles.size() / 3 / 2) << "work to do";
    optimizer.improve(points, keys, Vec3(0, 0, 1), 1e-9, triangles);
    EXPECT_EQ(bad(), 0u);
    EXPECT_LT(optimizer.joined_half_edges(), 5 * triangles.size()) << n;
    EXPECT_LT(optimizer.seen_triangles(), 2 * triangles.size()) << n;
  }
}

}  // namespace
}  // namespace polyhull::test
