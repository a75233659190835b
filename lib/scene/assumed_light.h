// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sun, and the light of a scene that has none.
#pragma once

#include "scene/scene.h"

namespace polyhull {

/// Makes \p light the sun over a scene in \p bounds: a square far away, \p degrees wide, towards the
/// third of \p axes (unit length, right-handed), with sides along the others. \p irradiance is that of
/// a surface that faces it.
void set_sun(const Bounds& bounds, const Mat3& axes, const Vec3& irradiance, double degrees,
             Light& light);

/// Adds to \p scene what viewers light models by: an even white sky all around, which reaches into
/// corners but not into closed rooms, and a soft sun, twice as bright where it falls straight on, from
/// the right (+x) above the front (+z); and sets the exposure for them, as automatic_exposure() does,
/// unless the file gave one. Throws Error for a scene without vertices.
void assume_light(Scene& scene);

}  // namespace polyhull
