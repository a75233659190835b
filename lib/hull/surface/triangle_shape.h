// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is wrong with a triangle of the hull, judged in the float coordinates it will have.
#pragma once

#include <algorithm>

#include "base/vector.h"

namespace polyhull::hull {

enum class Shape { good, sliver, broken };

/// A sliver's height against its longest edge.
inline constexpr double sliver_height = 0.002;

/// broken: without area, or turned against its face, whose unit normal is \p normal. A triangle
/// that stands at right angles to its face up to rounding counts as turned.
inline Shape shape_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
  const Vec3 ab = b - a, bc = c - b, ca = a - c;
  const Vec3 twice_area = glm::cross(ab, bc);
  const double facing = glm::dot(twice_area, normal), squared = glm::dot(twice_area, twice_area);
  constexpr double least = 1e-9;  // cosine; the normals' own error is about 1e-15
  if (!(facing > 0.0) || facing * facing <= least * least * squared) return Shape::broken;
  const double longest = std::max({glm::dot(ab, ab), glm::dot(bc, bc), glm::dot(ca, ca)});
  // Twice the area is the height times the longest edge.
  return squared < sliver_height * sliver_height * longest * longest ? Shape::sliver : Shape::good;
}

}  // namespace polyhull::hull
