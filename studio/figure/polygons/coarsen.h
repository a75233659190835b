// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A closed mesh with fewer triangles in nearly the same place.
///
/// Edges are drawn together to points, always that one first which takes the surface least far from
/// where it was, by the sum of squared distances to the planes of the triangles that a vertex stands
/// for (M. Garland, P. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH
/// 1997). The point is where that sum is least, for a curved surface a little outside of it, so that
/// outlines stay. What is flat gets large triangles, what is round small ones.
#pragma once

#include <cstddef>
#include <vector>

#include "studio/figure/polygons/polygonise.h"

namespace polyhull {

/// Draws edges of \p mesh together until no more than \p triangles are left or none can go without
/// harm to its topology. The vertices carry \p values besides, \p value_count each, whose
/// differences count as so many units of length: where they change, triangles stay small.
void coarsen(TriangleMesh& mesh, std::size_t triangles, const std::vector<float>& values,
             std::size_t value_count);

}  // namespace polyhull
