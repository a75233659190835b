// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is too thin for the grid: fingers, a stick, a ponytail's end. A ray there finds no place
/// where f is near 0, and the hull around it is thinner than the nodes are apart.
#pragma once

#include <span>

#include "refine/field/contact_rays.h"
#include "refine/field/hull_distance.h"

namespace polyhull::refine {

/// Puts the cells around the middle of the hull inside the surface, a hair, for every ray whose rim
/// is still outside and along which the hull is less than \p half_thickness thick to each side of
/// that middle: the surface then keeps to the nodes there. \p rays with their rims on \p fine, on
/// whose pieces (of the middle grid, from which \p fine were made) the middle is looked for; the
/// rims of those that were helped move there. Returns how many were.
std::size_t keep_thin_parts(std::span<Level> fine, ContactRays& rays, const HullDistance& hull,
                            float half_thickness, int threads);

}  // namespace polyhull::refine
