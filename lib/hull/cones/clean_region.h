// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Any rings made into simple, disjoint ones.
///
/// Rings may cross themselves and each other, touch, run twice over the same edge, or have spikes.
/// The region they mean is that of the even-odd rule; of several layers, the intersection. Points
/// are rounded to a grid of 2^-12 px (coarser for coordinates beyond 2^15), edges split where they
/// cross or pass within half a grid step of a point (iterated snap rounding: Halperin and Packer
/// 2002), and of the pieces those are kept that have the region on one side only. At points where
/// the region touches itself the rings are parted so that each keeps to its own part.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull::hull {

/// Rings with the origin of each edge (the one that begins at the point).
struct Contours {
  std::vector<Vec2> points;           ///< pixels, one ring after the other
  std::vector<std::uint32_t> ends;    ///< of each ring, into points
  std::vector<std::uint32_t> source;  ///< per point, its edge's number in the input
  std::vector<std::int32_t> view;     ///< per point, the view that its edge is of
  void clear() {
    points.clear();
    ends.clear();
    source.clear();
    view.clear();
  }
};

/// The solid part of the picture: the intersection of the layers' even-odd regions, or with
/// \p complement of what those leave out. In the result x1 y2 - x2 y1 is positive around parts of
/// the solid. \p grid_step_factor coarsens the grid, for a caller that has found a result which was
/// still not simple.
Contours clean_region(std::span<const Contours> layers, bool complement,
                      double grid_step_factor = 1.0);

}  // namespace polyhull::hull
