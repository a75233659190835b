// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Removal of slivers and of what rounding to float has flattened or flipped.
///
/// A bad triangle loses its shortest edge (half-edge collapse of one end onto the other) or its
/// longest (edge flip). Both keep the mesh closed and manifold: a collapse needs the ends to have
/// exactly two common neighbours with more than three edges each, a flip that the new edge does not
/// exist. A collapse moves no point of the surface further than the edge is long, a flip not
/// further than the triangle is high; each vertex carries the sum of what moved its surroundings,
/// and nothing is done that would take it beyond the limit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/hull.h"

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
  enum class Shape { good, sliver, broken };
  Shape shape(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t face) const;
  Shape shape(std::uint32_t triangle) const;
  void connect();
  bool mend(std::uint32_t triangle);
  bool collapse(std::uint32_t half_edge);
  bool flip(std::uint32_t half_edge);
  bool joined(std::uint32_t a, std::uint32_t b) const;
  std::uint32_t valence(std::uint32_t vertex) const;
  void rebuild();
  static std::uint32_t following(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  std::uint32_t from(std::uint32_t h) const { return hull_->triangles[h]; }
  std::uint32_t to(std::uint32_t h) const { return hull_->triangles[following(h)]; }
  /// The next half-edge that leaves the same vertex.
  std::uint32_t turn(std::uint32_t h) const { return opposite_[following(following(h))]; }

  Hull* hull_ = nullptr;
  std::span<const Vec3> normals_;
  double limit_ = 0.0;
  bool slivers_ = false;
  std::vector<std::uint32_t> opposite_, leaving_, face_of_;
  std::vector<double> moved_;
  std::vector<char> dead_;
  std::vector<std::uint32_t> work_;
};

}  // namespace polyhull::hull
