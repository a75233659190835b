// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a rig's world to metres with y up, as scenes and glTF have it.
#pragma once

#include "base/vector.h"

namespace polyhull {

/// Turns \p up to +y along the shorter way (from straight below about x), then scales units to
/// metres, about the world's origin. The identity for metres with y up.
Mat4 scene_from_world(const Vec3& up, double metres_per_unit);

}  // namespace polyhull
