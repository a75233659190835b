// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a planar mirror does to space.
#pragma once

#include "base/vector.h"

namespace polyhull {

/// Reflection at the plane dot(normal, X) = offset, \p normal of unit length.
inline Mat4 reflection(const Vec3& normal, double offset) {
  Mat4 m(Mat3(1.0) - 2.0 * glm::outerProduct(normal, normal));
  m[3] = Vec4(2.0 * offset * normal, 1.0);
  return m;
}

}  // namespace polyhull
