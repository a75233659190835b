// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A skin given as the zero level of a function: smooth union of simple bodies, each on a bone.
///
/// f(p) = smin(d_1(p), d_2(p), ...) with smin(a, b) = min(a, b) - h^2 / (4 k), h = max(k - |a - b|,
/// 0): the polynomial smooth minimum of width k, which rounds the crease between two bodies. d_i is
/// the signed distance to a cone with spherical ends or to an ellipsoid (negative inside; for
/// flattened bodies a bound of it, which is enough: vertices are put onto f = 0 by Newton steps
/// along the gradient). Distances of round cones and ellipsoids: I. Quilez, "Distance functions".
#pragma once

#include <vector>

#include "base/vector.h"

namespace polyhull {

/// One body of an implicit skin. Metres.
struct SkinBody {
  enum class Kind { cone, ellipsoid };
  Kind kind = Kind::cone;
  int bone = 0;              ///< that moves it
  Vec3f a{0.0f};             ///< cone: first end; ellipsoid: centre
  Vec3f b{0.0f};             ///< cone: other end; ellipsoid: the three radii
  float ra = 0.0f;           ///< cone: radius at a
  float rb = 0.0f;           ///< cone: radius at b
  Vec3f squash{0.0f};        ///< cone: direction in which it is flattened, unit length
  float flatness = 1.0f;     ///< cone: its extent along `squash`, 1 = round
  float blend = 0.03f;       ///< width of the smooth minimum with the bodies before it
  bool above_floor = false;  ///< cut off at y = 0
  float cut = 1e9f;          ///< cut off where dot(cut_normal, p) > cut
  Vec3f cut_normal{0.0f, 0.0f, 1.0f};
};

/// The signed distance (or a bound of it) from \p p to \p body.
float distance_to_body(const SkinBody& body, const Vec3f& p);

/// f(p) of the whole skin. Bodies too far away to matter are passed over, by spheres around them.
float skin_value(const std::vector<SkinBody>& bodies, const Vec3f& p);

/// The gradient of f by central differences, not normalised.
Vec3f skin_gradient(const std::vector<SkinBody>& bodies, const Vec3f& p);

/// The same from four values instead of six, a little less exact.
Vec3f rough_skin_gradient(const std::vector<SkinBody>& bodies, const Vec3f& p);

}  // namespace polyhull
