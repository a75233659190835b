// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Removal of slivers and of what rounding to float has flattened or flipped.
///
/// A bad triangle loses its shortest edge (half-edge collapse of one end onto the other) or its
/// longest (edge flip). Both keep the mesh closed and manifold: a collapse needs the ends to have
/// exactly two common neighbours with more than three edges each, a flip that the new edge does not
/// exist.
///
/// How far the surface has moved is kept as one number per vertex, m, which bounds the distance at
/// a point of a triangle by the mean of its corners' m with the point's barycentric coordinates as
/// weights. Collapsing u onto v takes each point of the triangles around u to the point with the
/// same coordinates in v's place, so m(v) := max(m(v), m(u) + |uv|), and no other changes. A flip
/// of the edge a-b for the flat triangle (a, b, c) of height h is the move of c by h onto the edge
/// and back: m(c) := max(m(a), m(b), m(c)) + 2 h. Nothing is done that would take a number beyond
/// the limit, nor, for slivers, anything that would make triangles cross. Where triangles are still
/// broken, vertices are moved by a few steps of the float grid (settle.h). Whole parts smaller than
/// the limit with broken triangles are dropped.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/hull.h"
#include "hull/surface/crossing_guard.h"
#include "hull/surface/half_edge.h"
#include "hull/surface/triangle_shape.h"

namespace polyhull::hull {

class Simplifier {
 public:
  /// Whether the triangle is flat, or turned against its face, in float coordinates.
  static bool broken(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3& normal);

  /// Mends the hull in place. \p normals: of the faces, out of the solid. With \p max_deviation 0
  /// only broken triangles are mended, within the rounding of the coordinates; else slivers too.
  /// Faces keep their order; those that vanish are dropped.
  void simplify(Hull& hull, std::span<const Vec3> normals, double max_deviation);

 private:
  Shape shape(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t face) const;
  Shape shape(std::uint32_t triangle) const;
  void connect();
  bool manifold() const;
  bool mend_all();
  bool mend(std::uint32_t triangle);
  std::vector<std::uint32_t> all_broken() const;
  bool drop_specks();
  std::size_t settle_all(double grid);
  bool would_cross(std::span<const std::uint32_t> around, std::uint32_t v, std::uint32_t gone0,
                   std::uint32_t gone1);
  bool collapse(std::uint32_t half_edge);
  bool flip(std::uint32_t half_edge);
  void rebuild();

  Hull* hull_ = nullptr;
  std::span<const Vec3> normals_;
  double limit_ = 0.0;
  double step_ = 0.0;     ///< of the float grid at the largest coordinate
  bool slivers_ = false;  ///< they count as bad, too
  bool guarded_ = false;  ///< nothing may make triangles cross
  CrossingGuard guard_;
  HalfEdges edges_;
  std::vector<std::uint32_t> opposite_, leaving_, face_of_;
  std::vector<double> moved_;
  std::vector<char> dead_;
  std::vector<std::uint32_t> work_;
};

}  // namespace polyhull::hull
