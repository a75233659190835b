// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The rings of a silhouette as regions: which lies in which, and points all over one.
#pragma once

#include <cstdint>
#include <vector>

#include "base/rings.h"

namespace polyhull::hull {

struct RingRegion {
  double area = 0.0;         ///< px², negative for holes
  std::int32_t parent = -1;  ///< the smallest ring around it; -1: none
};

/// One entry per ring of \p rings; a ring without points has area 0.
std::vector<RingRegion> regions_of(const Rings& rings);

/// About \p count points on a square grid inside ring \p ring, whose area \p area is not 0, and on
/// its side of \p rings: background in a hole, foreground in others. Fewer, or none, where the ring
/// is thinner than a quarter pixel.
std::vector<Vec2> points_inside(const Rings& rings, std::size_t ring, double area, int count);

}  // namespace polyhull::hull
