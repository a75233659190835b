// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Light from a parallelogram, a spot or a point.
///
/// The irradiance that a parallelogram of constant radiance L sends to a point x with normal n,
/// nothing between them, is Lambert's formula E = L/2 sum_i theta_i dot(gamma_i, n): over the edges
/// of the part above x's horizon, theta_i the angle that edge i subtends at x and gamma_i the unit
/// normal of the plane through x and that edge (Baum, Rushmeier, Winget, SIGGRAPH 1989, equation
/// 9).
#pragma once

#include "scene/scene.h"

namespace polyhull {

/// E / L: the irradiance at \p point with unit normal \p normal from \p light unoccluded, per unit
/// of its radiance (area) or intensity (point). At most pi for area lights; 0 behind the light. Not
/// for spots, which have no closed form.
float unoccluded_irradiance(const Light& light, const Vec3f& point, const Vec3f& normal);

/// A way to a light: the place, and the weight by which radiance (or intensity) becomes irradiance
/// when the way is free; the mean weight over uniform points of the square is
/// unoccluded_irradiance(). `whole` is the weight without a spot's cone.
struct LightSample {
  Vec3f place;
  float weight = 0.0f, whole = 0.0f;
};
LightSample sample_light(const Light& light, const Vec2f& square, const Vec3f& point,
                         const Vec3f& normal);

}  // namespace polyhull
