// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// GoogleTest assertions that a hull is right: sound in itself, on the planes it names, and filled
/// where the silhouettes say so.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "hull/build/hull_builder.h"
#include "support/membership.h"
#include "support/mesh_checks.h"
#include "support/scenes.h"

namespace polyhull::test {

/// Within the scene's bounds.
inline HullOptions within(const HullScene& scene) {
  HullOptions options;
  options.bounds = scene.rig.bounds;
  return options;
}

struct Expectation {
  std::size_t points = 20000;  ///< random points, half of them near the hull
  std::uint64_t seed = 1;
  bool simple = true;      ///< rings keep the conventions, so faces look the way their edges say
  bool snapped = false;    ///< rings may have been rounded to 2^-12 px
  double deviation = 0.0;  ///< world units that the surface may have moved (max_deviation)
};

/// The size of the hull and the cameras' distances in float steps: what rounding may move.
inline double rounding_of(const Hull& hull) {
  double largest = 0.0;
  for (const Vec3f& v : hull.vertices) {
    largest =
        std::max({largest, std::abs(double(v.x)), std::abs(double(v.y)), std::abs(double(v.z))});
  }
  const double far =
      std::max({std::abs(hull.origin.x), std::abs(hull.origin.y), std::abs(hull.origin.z)});
  return largest * 0x1p-23 + far * 0x1p-50;
}

/// How far 2^-12 px can be in the hull: rings that are not simple, and those of cameras with a
/// common centre, are rounded to that grid before anything else; the hull is exact for what
/// results.
inline double snapping_of(const Hull& hull, std::span<const Silhouette> views) {
  double farthest = 0.0;
  const Bounds box = box_of(hull, 0.0);
  for (const Silhouette& view : views) {
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                        i & 4 ? box.max.z : box.min.z);
      farthest = std::max(
          farthest, glm::length(corner - view.camera->centre()) / std::abs(view.camera->K[0][0]));
    }
  }
  return farthest * 0x1p-12;
}

/// Asserts everything that must hold; \p what names the scene in messages.
inline void expect_right(const Hull& hull, std::span<const Silhouette> views,
                         const HullOptions& options, const std::string& what,
                         const Expectation& expect = {}) {
  const MeshReport mesh = check_mesh(hull);
  EXPECT_TRUE(mesh.sound()) << what << ": " << mesh.describe();
  if (!mesh.sound()) return;
  EXPECT_GE(mesh.volume, 0.0) << what << ": inside out";
  const double rounding = rounding_of(hull) + expect.deviation +
                          (expect.snapped || !expect.simple ? snapping_of(hull, views) : 0.0);
  if (expect.deviation == 0.0) {
    const PlaneReport planes = check_planes(hull, views, options);
    EXPECT_EQ(planes.bad_source, 0u) << what;
    EXPECT_EQ(mesh.flat_triangles, 0u) << what << ": triangles without area";
    EXPECT_LE(planes.worst_distance, 4 * rounding) << what;
    EXPECT_EQ(planes.flipped, 0u) << what << ": " << planes.flipped << " of " << planes.checked
                                  << " triangles flipped";
    EXPECT_TRUE(!expect.simple || planes.wrong_side == 0)
        << what << ": " << planes.wrong_side << " faces look inward";
  }
  // Half of the points in a box a little larger than the hull, half in the bounds.
  std::size_t inside = 0;
  for (int round = 0; round < 2; ++round) {
    Bounds box = box_of(hull, 0.05);
    if (round == 1 || hull.empty()) {
      if (!options.bounds) continue;
      box = *options.bounds;
    }
    const auto report =
        compare_membership(hull, views, options, box, expect.points / 2, expect.seed + round);
    inside += report.inside;
    EXPECT_EQ(report.bad_winding, 0u) << what;
    // Rounding to float moves the surface; with few points hardly one falls into that gap.
    if (report.wrong() > 0) {
      EXPECT_LE(report.worst_distance, 4 * rounding)
          << what << ": " << report.missing << " missing, " << report.extra << " extra of "
          << report.points << " points, the worst at " << report.worst.x << " " << report.worst.y
          << " " << report.worst.z;
    }
  }
  EXPECT_TRUE(!hull.empty() || inside == 0) << what << ": the hull should not be empty";
}

}  // namespace polyhull::test
