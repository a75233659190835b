// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A calibrated camera.
///
/// x_cam = R X + t with z forward, x right, y down; the ideal (pinhole) pixel is
/// u = K (x_cam / z_cam), the real pixel is that point moved by the lens distortion in OpenCV's
/// model (k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]]), applied to normalised coordinates before K.
/// Pixels: the centre of the top-left pixel is (0, 0).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/vector.h"

namespace polyhull {

struct Camera {
  std::string name;
  int width = 0;                   ///< pixels of the full frame
  int height = 0;                  ///< pixels of the full frame
  Mat3 K{1.0};                     ///< upper triangular; may have skew
  std::vector<double> distortion;  ///< empty, or 4, 5, 8 or 12 coefficients in OpenCV's order
  Mat3 R{1.0};                     ///< world to camera, a rotation
  Vec3 t{0.0};                     ///< world units
  /// Brings its linear light (red, green, blue) to the colours that all cameras of its rig agree on.
  Mat3 colour{1.0};

  /// The centre of projection in world coordinates, -R^T t.
  Vec3 centre() const;

  /// Camera coordinates of the world point \p X.
  Vec3 to_camera(const Vec3& X) const { return R * X + t; }

  /// Pinhole pixel of \p X, without distortion; nothing for points on or behind the camera's plane.
  std::optional<Vec2> project_ideal(const Vec3& X) const;

  /// Real pixel of \p X, with distortion; nothing for points on or behind the camera's plane.
  std::optional<Vec2> project(const Vec3& X) const;

  /// World direction (not normalised; z_cam = 1) of the ray through the pinhole pixel \p ideal.
  Vec3 ray(const Vec2& ideal) const;

  /// Pinhole pixel to real pixel.
  Vec2 distort(const Vec2& ideal) const;

  /// Real pixel to pinhole pixel: Newton's method on distort(), to 1e-9 px where the model is
  /// invertible; outside its invertible disk the nearest point of the disk's rim is used, so the
  /// result is always finite. For many points make one Lens (lens.h).
  Vec2 undistort(const Vec2& real) const;

  bool has_distortion() const;
  bool operator==(const Camera&) const = default;
};

}  // namespace polyhull
