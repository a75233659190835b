// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sun, the light of a scene that has none, and that of all around it.
#pragma once

#include <memory>
#include <vector>

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

/// Has \p environment light \p scene, as bright as it is; and sets the exposure for it, as
/// automatic_exposure() does, unless the file gave one. Throws Error for a scene without vertices.
void set_environment(std::shared_ptr<const Environment> environment, Scene& scene);

/// The environment of \p scene as at most \p count areas far away that together give what it gives where
/// Scene::sky is 1 (Environment::parts()); none where it has no environment.
std::vector<Light> environment_lights(const Scene& scene, std::size_t count);

}  // namespace polyhull
