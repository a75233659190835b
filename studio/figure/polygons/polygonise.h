// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A closed triangle mesh of the zero level of a function, by marching tetrahedra.
///
/// Each cube of a grid is cut into six tetrahedra around its main diagonal (Kuhn's subdivision,
/// which agrees on the faces of neighbours). Within a tetrahedron the level is a plane that cuts
/// off one corner (one triangle) or two (two triangles), with no ambiguous case; vertices sit on
/// the edges of the tetrahedra, one per edge, so neighbours share them and the result is a closed,
/// oriented 2-manifold whenever the level stays inside the grid (A. Gueziec, R. Hummel, "Exploiting
/// triangulated surface extraction using tetrahedral decomposition", TVCG 1995).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// A triangle mesh; outside seen counter-clockwise.
struct TriangleMesh {
  std::vector<Vec3f> vertices;
  std::vector<std::uint32_t> triangles;
};

/// The zero level of \p value (negative inside) in the box \p min, \p max, at grid spacing \p step,
/// all in one unit of length. \p value must not grow faster than 1.7 times the distance (blocks far
/// from the level are skipped by that bound). Throws Error if the level touches the box.
TriangleMesh polygonise(const std::function<float(const Vec3f&)>& value, const Vec3f& min,
                        const Vec3f& max, float step);

/// Evens out the triangles: \p passes times each vertex moves to the mean of its neighbours and
/// back onto the level by Newton steps along \p gradient. Topology stays.
void relax(TriangleMesh& mesh, const std::function<float(const Vec3f&)>& value,
           const std::function<Vec3f(const Vec3f&)>& gradient, int passes);

/// What is wrong with a mesh that should be a closed, oriented 2-manifold.
struct ManifoldDefects {
  std::size_t open_edges = 0;        ///< with one triangle
  std::size_t crowded_edges = 0;     ///< with more than two triangles, or two of unlike direction
  std::size_t pinched_vertices = 0;  ///< whose triangles do not form one ring
  std::size_t empty_triangles = 0;   ///< with a vertex twice
  bool none() const { return open_edges + crowded_edges + pinched_vertices + empty_triangles == 0; }
};
/// Those of a mesh of \p vertex_count vertices.
ManifoldDefects manifold_defects(const std::vector<std::uint32_t>& triangles,
                                 std::size_t vertex_count);

}  // namespace polyhull
