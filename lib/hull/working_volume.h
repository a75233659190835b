// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A convex polyhedron in doubles that is cut by planes: where the hull can be at all.
#pragma once

#include <array>
#include <vector>

#include "base/vector.h"

namespace polyhull::hull {

class WorkingVolume {
 public:
  /// The box (min and max per axis).
  explicit WorkingVolume(const std::array<double, 6>& box);

  /// Keeps the part where normal.x + offset >= 0.
  void cut(const Vec3& normal, double offset);

  bool empty() const { return faces_.empty(); }

  /// All corners (some more than once).
  template <class Visit>
  void visit_corners(Visit visit) const {
    for (const auto& face : faces_)
      for (const Vec3& corner : face) visit(corner);
  }

 private:
  std::vector<std::vector<Vec3>> faces_;
};

}  // namespace polyhull::hull
