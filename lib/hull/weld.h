// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Merging of near vertices, for programs that want fewer of them. The exact hull never needs it.
#pragma once

#include "hull/hull.h"

namespace polyhull {

/// Merges each vertex of \p hull with the first earlier one within \p distance (world units), and
/// removes triangles and loops that vanish. The surface moves by at most \p distance but need not
/// be a 2-manifold afterwards. A distance of 0 changes nothing.
void weld_vertices(Hull& hull, double distance);

}  // namespace polyhull
