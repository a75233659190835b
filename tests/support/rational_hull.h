// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The hull by brute force in rational numbers: nothing is rounded, nothing is clever, nothing is
/// shared with lib/hull.
///
/// Symbols: P = K [R | t], taken as the exact rational values of its doubles. A world point X is
/// seen at h = P (X, 1), pixel h.xy / h.z, in front where h.z > 0. A contour edge from pixel p to q
/// has the line l = (p, 1) x (q, 1) and, through the camera's centre, the plane P^T l. In general
/// position a vertex of the hull is a point where three planes meet, that lies on the contour edge
/// of each of the three (within the segment, in front), and strictly inside all other silhouettes
/// and bounds; every such triple is tried.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull::test {

struct RationalHull {
  /// Nothing touches: no point lies on more planes than it needs. Otherwise `vertices` is not
  /// complete.
  bool general_position = true;
  std::vector<Vec3> vertices;  ///< each rounded once from its exact coordinates
};

/// All vertices of the hull; planes^3 steps of rational arithmetic: for some sixty contour edges in
/// all. Rings must be simple and disjoint.
RationalHull rational_hull(std::span<const Silhouette> silhouettes,
                           const std::optional<Bounds>& bounds);

enum class Place { outside, boundary, inside };

/// Where the world point \p X (its doubles taken exactly) lies, under Unseen::carve.
Place rational_place(std::span<const Silhouette> silhouettes, const std::optional<Bounds>& bounds,
                     const Vec3& X);

}  // namespace polyhull::test
