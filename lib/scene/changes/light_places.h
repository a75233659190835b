// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lights that are moved.
#pragma once

#include "scene/scene.h"

namespace polyhull {

/// Whether \p light is too far from what is within \p bounds to be anything but a sun.
bool is_sun(const Light& light, const Bounds& bounds);

/// \p point turned about the middle of \p bounds.
Vec3f around(const Mat3& turn, const Bounds& bounds, const Vec3f& point);

/// Holds \p light to what can be drawn with (drawable.h), whatever several changes add up to.
void hold(Light& light);

}  // namespace polyhull
