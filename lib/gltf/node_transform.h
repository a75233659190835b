// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A node's transform in the parts that glTF animates.
#pragma once

#include "base/vector.h"

namespace polyhull {

/// x becomes translation + rotation (scale x), from the node's coordinates to its parent's.
struct NodeTransform {
  Vec3 translation{0.0};
  Vec4 rotation{0.0};  ///< a quaternion x, y, z, w of any length; of length 0: none
  Vec3 scale{1.0};
  Mat4 matrix() const;
};

}  // namespace polyhull
