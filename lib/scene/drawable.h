// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// With which numbers a picture can be drawn, for who reads them and for who draws with them.
#pragma once

#include <vector>

#include "rig/camera.h"
#include "scene/scene.h"

namespace polyhull {

/// Whether \p v is finite and at most 1e9 (metres) on each axis.
bool within_reach(const Vec3f& v);

/// Whether \p light is farther from the middle of \p bounds than \p sizes times their diagonal.
bool is_beyond(const Light& light, const Bounds& bounds, double sizes);

/// Throws Error for a viewport that is not finite, has no size, no focal length or no rotation, or
/// whose K is not of the form [f s c; 0 f c; 0 0 1], pixels.
void check_viewport(const Camera& camera);

/// Throws Error for a viewport whose focal lengths are not from 1e-4 to 1e5 times the picture's size, or
/// whose principal point or skew is beyond that: at any size that the picture may be drawn at, and
/// distorted, there is a projection otherwise.
void check_projection(const Camera& camera);

/// Throws Error for light that is not finite or below 0, and for what of it is beyond 1e9 m or above
/// 1e9, or a spot's cone that is none: \p exposure, \p ambient and \p sky as in Announcement.
void check_light(const std::vector<Light>& lights, float exposure, const Vec3f& ambient,
                 const Vec3f& sky);

}  // namespace polyhull
