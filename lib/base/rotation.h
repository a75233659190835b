// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a matrix that was read from somewhere is a rotation.
#pragma once

#include <algorithm>
#include <cmath>

#include "base/vector.h"

namespace polyhull {

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
