// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Four floats that the compiler keeps in one register: colours in hot loops.
#pragma once

#include "base/vector.h"

namespace polyhull {

using Float4 = float __attribute__((vector_size(16)));

inline Float4 to_float4(const Vec3f& v) {
  return Float4{v.x, v.y, v.z, 0.0f};
}
inline Vec3f to_vector(const Float4& v) {
  return {v[0], v[1], v[2]};
}

}  // namespace polyhull
