// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Vector and matrix types used throughout: GLM's, in double precision unless the name says float.
/// GLM matrices are column-major: m[column][row]. Text formats (rig files, P matrices) are
/// row-major; from_rows() and to_rows() convert.
#pragma once

#include <array>
#include <glm/glm.hpp>

namespace polyhull {

using Vec2 = glm::dvec2;
using Vec3 = glm::dvec3;
using Vec4 = glm::dvec4;
using Mat3 = glm::dmat3;
using Mat4 = glm::dmat4;
using Vec2f = glm::vec2;
using Vec3f = glm::vec3;
using Mat3f = glm::mat3;

/// The area of the parallelogram of two vectors in the plane, positive where the way from \p a to
/// \p b is the one from x to y.
template <class T>
T cross(const glm::vec<2, T>& a, const glm::vec<2, T>& b) {
  return a.x * b.y - a.y * b.x;
}

/// The matrix whose entries in reading order (row by row) are \p m.
inline Mat3 from_rows(const std::array<double, 9>& m) {
  return glm::transpose(Mat3(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]));
}

/// The entries of \p m in reading order (row by row).
inline std::array<double, 9> to_rows(const Mat3& m) {
  return {m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]};
}

/// An axis-aligned box in world coordinates, min <= max in each axis.
struct Bounds {
  Vec3 min{0.0};
  Vec3 max{0.0};
  bool operator==(const Bounds&) const = default;
};

/// A rectangle of whole pixels: columns x .. x+width-1, rows y .. y+height-1.
struct Rectangle {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  bool empty() const { return width <= 0 || height <= 0; }
  bool operator==(const Rectangle&) const = default;
};

}  // namespace polyhull
