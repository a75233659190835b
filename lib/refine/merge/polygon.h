// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A merged box's polygon as triangles: see merged_cells.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull::refine {

struct PolygonCorner {
  Vec3f point{0.0f}, normal{0.0f};
  unsigned faces = 0;  ///< of the box, on which it lies: a bit each
  std::uint32_t vertex = 0;
};

/// Whether the triangle \p a, \p b, \p c faces \p normal.
bool faces(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& normal);

/// Appends the polygon's triangles, three vertices each: of all ways to cut it without a diagonal on
/// a face of the box, and with all triangles facing \p normal (unit), that with the least sum of
/// areas, squares of longest sides, and of diagonals' lengths times how far they leave the surface by
/// its normals; found by dynamic programming (Klincsek 1980). False where there is none.
bool cut_polygon(std::span<const PolygonCorner> corners, const Vec3f& normal,
                 std::vector<std::uint32_t>& triangles);

}  // namespace polyhull::refine
