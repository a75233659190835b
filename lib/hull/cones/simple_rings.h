// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a cone's rings are what the hull needs: simple and apart from each other.
#pragma once

#include <cstdint>

#include "hull/cones/cone.h"

namespace polyhull::hull {

/// The value of the plane at the direction. Exact.
inline Int128 dot(const Plane& p, const IntVec& d) {
  return p.a * d[0] + p.b * d[1] + p.c * d[2];
}

/// The exact sign of the vertex's ray against the edge's plane.
int side_of(const Cone& cone, std::uint32_t edge, std::uint32_t vertex);

/// Whether no edge of \p cone, whose grid is built, meets another. Rings that come nearer than 1e-6
/// px do; \p clean ones may touch in vertices. Notes Cone::compared_pairs.
bool are_simple(Cone& cone, bool clean);

}  // namespace polyhull::hull
