// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A body whose surface is known, and how far a hull is from it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/picture.h"
#include "hull/hull.h"
#include "rig/rig.h"

namespace polyhull::test {

/// Triangles with double coordinates.
struct Surface {
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Reads an OBJ file's faces, polygons fanned. Throws Error when it cannot be read.
Surface load_surface(const std::string& path);
Surface surface_of(const Hull& hull);
double volume_of(const Surface& surface);

/// What \p camera sees of \p surface: 0..255 by coverage, each pixel sampled \p samples x \p
/// samples times.
Picture mask_of(const Surface& surface, const Camera& camera, int samples);

/// Pixels of both over pixels of either, at half coverage.
double intersection_over_union(const Picture& a, const Picture& b);

/// Distances from points spread over one surface to the other.
struct SurfaceDistance {
  double greatest = 0.0;
  double mean = 0.0;
};

/// From about \p count points of \p from (all vertices, and points by area) to the surface \p to.
SurfaceDistance distance_between(const Surface& from, const Surface& to, std::size_t count);

}  // namespace polyhull::test
