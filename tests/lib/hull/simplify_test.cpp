// SPDX-License-Identifier: LGPL-2.1-or-later
// What the simplifier may move, to the edge's length.
#include "hull/surface/simplify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace polyhull::hull {
namespace {

constexpr double height = 40.0;

/// A tall prism over a convex polygon (counter-clockwise), one face per side and two for the ends.
struct Prism {
  Hull hull;
  std::vector<Vec3> normals;

  explicit Prism(const std::vector<Vec2>& outline) {
    const auto n = static_cast<std::uint32_t>(outline.size());
    for (const double z : {0.0, height})
      for (const Vec2& p : outline) hull.vertices.emplace_back(p.x, p.y, z);
    const auto face = [&](const Vec3& normal, const std::vector<std::uint32_t>& triangles) {
      HullFace f;
      f.first_triangle = static_cast<std::uint32_t>(hull.triangles.size() / 3);
      f.triangle_count = static_cast<std::uint32_t>(triangles.size() / 3);
      hull.faces.push_back(f);
      hull.triangles.insert(hull.triangles.end(), triangles.begin(), triangles.end());
      normals.push_back(normal);
    };
    std::vector<std::uint32_t> lower, upper;
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      const Vec2 along = outline[j] - outline[i];
      face(glm::normalize(Vec3(along.y, -along.x, 0)), {i, j, n + j, i, n + j, n + i});
      if (i < 1 || i + 1 >= n) continue;
      lower.insert(lower.end(), {0, i + 1, i});
      upper.insert(upper.end(), {n, n + i, n + i + 1});
    }
    face({0, 0, -1}, lower);
    face({0, 0, 1}, upper);
  }

  /// How far the furthest of the first vertices is from the nearest of those that are left.
  double moved(const Hull& left) const {
    double worst = 0.0;
    for (const Vec3f& was : hull.vertices) {
      double nearest = 1e9;
      for (const Vec3f& is : left.vertices)
        nearest = std::min<double>(nearest, glm::length(was - is));
      worst = std::max(worst, nearest);
    }
    return worst;
  }
};

Hull simplified(const Prism& prism, double deviation) {
  Hull hull = prism.hull;
  Simplifier().simplify(hull, prism.normals, deviation);
  return hull;
}

// The face over the short edge is a sliver, and goes as soon as its edge may be closed.
TEST(Simplifier, AShortEdgeGoesWhenItsLengthMayBeMoved) {
  const double side = 0.01, cut = side / std::numbers::sqrt2;
  const Prism prism({{cut, 0}, {1, 0}, {1, 1}, {0, 1}, {0, cut}});
  for (const double deviation : {0.1, 0.55, 0.98}) {
    EXPECT_EQ(simplified(prism, deviation * side).vertices.size(), 10u) << deviation;
  }
  for (const double deviation : {1.02, 3.0}) {
    const Hull hull = simplified(prism, deviation * side);
    EXPECT_EQ(hull.vertices.size(), 8u) << deviation;
    EXPECT_EQ(hull.faces.size(), 6u) << deviation;
  }
}

// A round edge of many short ones: no vertex goes further than allowed, however many are closed.
TEST(Simplifier, ManyShortEdgesTogetherMoveNoFurther) {
  constexpr int steps = 24;
  constexpr double radius = 0.2, side = 2 * radius * 0.0327;
  std::vector<Vec2> outline{{1, 0}, {1, 1}, {0, 1}};
  for (int i = 0; i <= steps; ++i) {
    const double angle = std::numbers::pi * (1.0 + 0.5 * i / steps);
    outline.emplace_back(radius + radius * std::cos(angle), radius + radius * std::sin(angle));
  }
  const Prism prism(outline);
  for (const double edges : {1.2, 2.2, 4.5}) {
    const Hull hull = simplified(prism, edges * side);
    EXPECT_LT(hull.vertices.size(), prism.hull.vertices.size()) << edges;
    EXPECT_LE(prism.moved(hull), edges * side) << edges;
  }
  EXPECT_EQ(simplified(prism, 0.9 * side).vertices.size(), prism.hull.vertices.size());
}

}  // namespace
}  // namespace polyhull::hull
