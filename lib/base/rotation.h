// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rotations as people write them, and whether a matrix that was read from somewhere is one.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "base/vector.h"

namespace polyhull {

/// Turns by \p degrees about x, then y, then z.
inline Mat4 rotation_of(const Vec3& degrees) {
  const Vec3 angles = glm::radians(degrees);
  Mat4 turn = glm::rotate(Mat4(1.0), angles.z, Vec3(0, 0, 1));
  turn = glm::rotate(turn, angles.y, Vec3(0, 1, 0));
  return glm::rotate(turn, angles.x, Vec3(1, 0, 0));
}

/// How far the rows of \p R, whose numbers are finite, are from orthonormal: the largest entry of
/// |R Rᵀ - I|.
inline double orthonormal_error(const Mat3& R) {
  const Mat3 off = R * glm::transpose(R) - Mat3(1.0);
  double worst = 0.0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) worst = std::max(worst, std::abs(off[i][j]));
  return worst;
}

/// Likewise, and how far its determinant is from 1.
inline double rotation_error(const Mat3& R) {
  return std::max(orthonormal_error(R), std::abs(glm::determinant(R) - 1.0));
}

}  // namespace polyhull
