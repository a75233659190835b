// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Small moves of a few vertices, and other diagonals, after which no triangle around is flat or
/// turned.
///
/// A triangle (a, b, c) of a face with the unit normal n stands upright by
///   h = ((b - a) x (c - a)) . n / (its longest edge),
/// its height, negative if it is turned. Where features are as small as the steps of the float grid
/// rounding may have made some h negative, and moving one vertex for itself mends one triangle at
/// the cost of the next. Here the corners of a broken triangle, and if that does not do their
/// neighbours, take turns: each goes to that place of the grid around it where the heights of its
/// triangles fall short of a least height by the smallest sum, the nearest of equals; and a broken
/// triangle's edge inside its face becomes the other diagonal where that makes the sum smaller. So
/// the sum falls with each step, and the work ends when nothing is broken or nothing gets better.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/surface/half_edge.h"

namespace polyhull::hull {

/// A closed 2-manifold at work.
struct SettlingMesh {
  std::span<Vec3f> vertices;
  HalfEdges edges;
  std::span<const std::uint32_t> face_of;  ///< of each triangle, its normal's number
  std::span<const Vec3> normals;
  std::span<const Vec3f> from;    ///< the vertices before anything was settled
  std::span<const double> moved;  ///< of each vertex, what counts as moved already
  double limit = 0.0;             ///< of that and the way from there together
  double step = 0.0;              ///< of the float grid at the largest coordinate
  double grid = 0.0;              ///< of the places that vertices may go to
};

/// Works around the broken \p triangle until no triangle of the vertices at work is broken; false
/// if it ends before. What it did stays either way.
bool settle(const SettlingMesh& mesh, std::uint32_t triangle);

}  // namespace polyhull::hull
