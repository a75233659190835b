// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Do triangles of a mesh cross each other? By CGAL with exact predicates on the float coordinates.
#pragma once

#include <cstddef>

#include "hull/hull.h"

namespace polyhull::test {

/// The number of pairs of triangles that meet elsewhere than in the edge or vertex they share;
/// triangles without area count as pairs with themselves.
std::size_t count_self_intersections(const Hull& hull);

}  // namespace polyhull::test
