// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the adjustment differentiates: the board's corners as cameras see them, as functors for
/// Ceres. The lens is that of rig/lens.h, without skew.
#pragma once

#include <ceres/rotation.h>

#include <array>

#include "base/vector.h"

namespace polyhull::calibration {

/// fx fy cx cy, then k1 k2 p1 p2 k3.
constexpr int lens_parameters = 9;
/// A rotation vector and a translation.
constexpr int pose_parameters = 6;

/// The distorted point of the normalised point (\p x, \p y); \p k are 12 coefficients in OpenCV's
/// order (5 where \p full is false).
template <bool full, class Coefficient, class T>
void bend(const Coefficient* k, const T& x, const T& y, T* out) {
  const T s = x * x + y * y;
  T q = T(1.0) + s * (k[0] + s * (k[1] + s * k[4]));
  if constexpr (full) q /= T(1.0) + s * (k[5] + s * (k[6] + s * k[7]));
  out[0] = x * q + 2.0 * k[2] * x * y + k[3] * (s + 2.0 * x * x);
  out[1] = y * q + k[2] * (s + 2.0 * y * y) + 2.0 * k[3] * x * y;
  if constexpr (full) {
    out[0] += s * (k[8] + s * k[9]);
    out[1] += s * (k[10] + s * k[11]);
  }
}

/// From the board's corner to the camera's axes.
template <class T>
void to_camera(const T* camera, const T* board, const Vec3& corner, T* out) {
  const T local[3] = {T(corner.x), T(corner.y), T(corner.z)};
  T world[3];
  ceres::AngleAxisRotatePoint(board, local, world);
  for (int i = 0; i < 3; ++i) world[i] += board[3 + i];
  ceres::AngleAxisRotatePoint(camera, world, out);
  for (int i = 0; i < 3; ++i) out[i] += camera[3 + i];
}

/// Distance in pixels between a corner and where a camera with this lens and pose sees it.
struct CornerResidual {
  Vec3 corner;
  Vec2 seen;

  template <class T>
  bool operator()(const T* lens, const T* camera, const T* board, T* residual) const {
    T x[3];
    to_camera(camera, board, corner, x);
    if (!(x[2] > T(0.0))) return false;
    T bent[2];
    bend<false>(lens + 4, T(x[0] / x[2]), T(x[1] / x[2]), bent);
    residual[0] = lens[0] * bent[0] + lens[2] - seen.x;
    residual[1] = lens[1] * bent[1] + lens[3] - seen.y;
    return true;
  }
};

/// The same with a lens that is known, of up to 12 coefficients and with skew.
struct KnownLensResidual {
  Vec3 corner;
  Vec2 seen;
  Mat3 K;
  std::array<double, 12> k;

  template <class T>
  bool operator()(const T* camera, const T* board, T* residual) const {
    T x[3];
    to_camera(camera, board, corner, x);
    if (!(x[2] > T(0.0))) return false;
    T bent[2];
    bend<true>(k.data(), T(x[0] / x[2]), T(x[1] / x[2]), bent);
    residual[0] = K[0][0] * bent[0] + K[1][0] * bent[1] + K[2][0] - seen.x;
    residual[1] = K[1][1] * bent[1] + K[2][1] - seen.y;
    return true;
  }
};

}  // namespace polyhull::calibration
