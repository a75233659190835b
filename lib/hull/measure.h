// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What can be told of a hull's mesh by looking at it.
#pragma once

#include <cstdint>
#include <vector>

#include "hull/hull.h"

namespace polyhull {

/// Whether every directed edge of the triangles has exactly one partner in the other direction. An
/// empty mesh is closed.
bool is_closed(const Hull& hull);

/// The enclosed volume, world units cubed: the sum of the signed tetrahedra between the triangles
/// and the hull's origin, in double precision. Means something only for closed meshes.
double enclosed_volume(const Hull& hull);

/// Of each vertex the smallest vertex of the part that hangs together with it by triangles.
std::vector<std::uint32_t> connected_parts(const Hull& hull);

/// The share (0..1) of the triangles whose height is below 0.2 % of their longest edge.
double sliver_share(const Hull& hull);

}  // namespace polyhull
