// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rigid motions, as calibration chains them.
#pragma once

#include <array>

#include "base/vector.h"

namespace polyhull::calibration {

/// Takes x to R x + t.
struct Pose {
  Mat3 R{1.0};  ///< a rotation
  Vec3 t{0.0};

  Vec3 operator()(const Vec3& x) const { return R * x + t; }

  /// First \p b, then \p a.
  friend Pose operator*(const Pose& a, const Pose& b) { return {a.R * b.R, a.R * b.t + a.t}; }
};

inline Pose inverse(const Pose& pose) {
  const Mat3 back = glm::transpose(pose.R);
  return {back, -(back * pose.t)};
}

/// The pose as rotation vector (axis times angle, radians) and translation, and back.
std::array<double, 6> to_parameters(const Pose& pose);
Pose from_parameters(const double* parameters);

/// The angle of a rotation matrix, radians, 0 to pi.
double angle_of(const Mat3& rotation);

}  // namespace polyhull::calibration
