// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The convex hull of points in a plane.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// Which of the points are the corners of their convex hull, counter-clockwise where y points up. A
/// corner whose sides' cross product is \p flat (in the points' unit squared) or less is left out.
std::vector<std::uint32_t> convex_hull(std::span<const Vec2> points, double flat = 0.0);

}  // namespace polyhull
