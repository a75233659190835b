// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/pose.h"

#include <ceres/rotation.h>

#include <cmath>

namespace polyhull::calibration {

std::array<double, 6> to_parameters(const Pose& pose) {
  std::array<double, 6> out{};
  ceres::RotationMatrixToAngleAxis(&pose.R[0][0], out.data());  // both column by column
  for (int i = 0; i < 3; ++i) out[3 + i] = pose.t[i];
  return out;
}

Pose from_parameters(const double* parameters) {
  Pose pose;
  ceres::AngleAxisToRotationMatrix(parameters, &pose.R[0][0]);
  pose.t = Vec3(parameters[3], parameters[4], parameters[5]);
  return pose;
}

double angle_of(const Mat3& rotation) {
  double axis[3];
  ceres::RotationMatrixToAngleAxis(&rotation[0][0], axis);
  return std::hypot(axis[0], axis[1], axis[2]);
}

}  // namespace polyhull::calibration
