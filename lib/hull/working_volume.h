// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A convex polyhedron in doubles that is cut by planes: where the hull can be at all.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "base/vector.h"

namespace polyhull::hull {

class WorkingVolume {
 public:
  /// The box (min and max per axis: x, x, y, y, z, z).
  explicit WorkingVolume(const std::array<double, 6>& box);

  /// Keeps the part of points p where dot(normal, p) + offset >= 0.
  void cut(const Vec3& normal, double offset);

  bool empty() const { return corners_.empty(); }

  /// All corners (some more than once).
  template <class Visit>
  void visit_corners(Visit visit) const {
    for (const Vec3& corner : corners_) visit(corner);
  }

 private:
  /// The faces' corners, one face after the other, and where each face ends in them.
  std::vector<Vec3> corners_;
  std::vector<std::size_t> ends_;
  std::vector<Vec3> kept_, rim_;  ///< at work in cut()
  std::vector<std::size_t> kept_ends_;
  std::vector<double> values_;
  std::vector<std::pair<double, Vec3>> sorted_;
};

}  // namespace polyhull::hull
