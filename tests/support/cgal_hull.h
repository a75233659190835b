// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The hull by CGAL's booleans: each silhouette's cone as a closed mesh between two depths,
/// intersected one after the other (polygon mesh processing, corefinement). Slow, and independent
/// of lib/hull.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull::test {

struct CgalHull {
  bool done = false;  ///< false: CGAL refused the cones, or its result would not be manifold
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  double volume = 0.0;
  double seconds = 0.0;  ///< of the booleans alone, without making the cones
};

/// With exact constructions (EPECK): the truth, for small scenes. Rings must be simple and
/// disjoint. Cones reach from camera depth \p near to \p far, world units.
CgalHull cgal_hull_exact(std::span<const Silhouette> silhouettes,
                         const std::optional<Bounds>& bounds, double near, double far);

/// With rounded constructions (EPICK): the peer that benchmarks run against.
CgalHull cgal_hull_inexact(std::span<const Silhouette> silhouettes,
                           const std::optional<Bounds>& bounds, double near, double far);

}  // namespace polyhull::test
