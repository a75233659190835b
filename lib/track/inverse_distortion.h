// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A lens that is told from distorted to undistorted points, in OpenCV's terms, which go the other way.
///
/// No coefficients of the one are exactly some of the other. So many points on the sensor are
/// undistorted by what is told, and OpenCV's twelve coefficients are those that bring them back with
/// the least squares of the errors (Gauss and Newton's steps; the model is linear in all but the
/// denominator's). Numerator and denominator say nearly the same where a lens distorts little: of all
/// coefficients that fit, those near 0 are taken.
#pragma once

#include <optional>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// A point without and with the lens's distortion, normalised (z = 1).
struct DistortedPoint {
  Vec2 ideal{0.0}, real{0.0};
};

/// OpenCV's twelve coefficients that take each point's `ideal` to its `real`; none where one of them
/// is missed by more than \p tolerance, or anything is not finite.
std::optional<std::vector<double>> fit_distortion(const std::vector<DistortedPoint>& points,
                                                  double tolerance);

/// What a lens told last, and what came of it: it tells the same again and again.
struct FittedDistortion {
  std::vector<double> told;
  std::optional<std::vector<double>> coefficients;
};

}  // namespace polyhull
