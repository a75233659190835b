// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Surfaces of triangles in double precision, and how far they are from each other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// Triangles with double coordinates, outside seen counter-clockwise.
struct TriangleSurface {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

TriangleSurface surface_of(const Hull& hull);

/// What \p surface encloses, if it is closed; the cube of its unit.
double volume_of(const TriangleSurface& surface);

/// Distances from points spread over one surface to the other, in their unit.
struct SurfaceDistance {
  double mean = 0.0;
  double p95 = 0.0;  ///< 95 % of the points are nearer
  double greatest = 0.0;
};

/// From \p count points spread evenly over the area of \p from, and for the greatest its vertices,
/// too, to the nearest points of \p to (Embree's point queries; of a triangle: C. Ericson,
/// "Real-Time Collision Detection", 5.1.5). The same for any number of threads; right to a
/// millionth of the coordinates. Infinite where \p to has no triangles, all 0 where \p from has
/// none.
SurfaceDistance distance_between(const TriangleSurface& from, const TriangleSurface& to,
                                 std::size_t count);

}  // namespace polyhull
