// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A convex shape around the hull of silhouettes.
#pragma once

#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// The corners of the intersection of the pyramids over the silhouettes' bounding rectangles, world
/// coordinates, of at most eight views spread evenly over \p views; limited, as the hull of
/// HullBuilder::build(), to a cube 1024 times as large as the rig. Some corners may be there more than
/// once. Empty where the pyramids do not meet. Every view has a silhouette; there are two or more.
std::vector<Vec3> enclosing_corners(std::span<const Silhouette> views);

}  // namespace polyhull
