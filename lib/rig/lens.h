// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Lens distortion in OpenCV's model, and its inverse.
///
/// With (x, y) normalised coordinates (z = 1), s = x^2 + y^2 and
/// q(s) = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3), the distorted point is
///
///     x' = x q(s) + 2 p1 x y + p2 (s + 2 x^2) + s1 s + s2 s^2
///     y' = y q(s) + p1 (s + 2 y^2) + 2 p2 x y + s3 s + s4 s^2
///
/// (OpenCV, module calib3d). The radial map r -> r q(r^2) grows only up to the first root of its
/// derivative: that radius bounds the disk in which the model means something. Barrel lenses are
/// often calibrated with a disk smaller than the picture's corners, so the inverse must not trust
/// Newton's method there.
#pragma once

#include <array>

#include "rig/camera.h"

namespace polyhull {

/// The distortion of one camera: the formula alone, cheap to make. Works on pixels.
class Distortion {
 public:
  explicit Distortion(const Camera& camera);

  /// Whether the model moves any point at all.
  bool active() const { return active_; }

  /// Pinhole pixel to real pixel, by the formula, also outside the invertible disk.
  Vec2 distort(const Vec2& ideal) const;

 protected:
  Vec2 normalised(const Vec2& pixel) const;
  Vec2 pixel(const Vec2& normalised) const;
  Vec2 bend(const Vec2& p) const;
  double radial(double r) const;

  double fx_, fy_, skew_, cx_, cy_;
  std::array<double, 12> k_{};  // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4
  bool active_ = false;
};

/// The distortion and its inverse. Making one solves for the invertible disk (microseconds): make
/// one per camera, not per point.
class Lens : public Distortion {
 public:
  explicit Lens(const Camera& camera);

  /// Radius of the invertible disk in normalised coordinates, at most 1000; 0 without distortion.
  double invertible_radius() const { return invertible_radius_; }

  /// Real pixel to pinhole pixel, to 1e-9 px (1e-6 px where rounding leaves no more); where the
  /// real pixel has no original inside the invertible disk, the point of the disk's rim whose image
  /// is nearest.
  Vec2 undistort(const Vec2& real) const;

 private:
  double invert_radial(double distorted_radius) const;
  bool newton(const Vec2& target, Vec2& p) const;
  Vec2 nearest_on_rim(const Vec2& target) const;

  double invertible_radius_ = 0.0;
  double rim_image_ = 0.0;  // radial(invertible_radius_)
};

/// The share of \p camera's picture, by a grid of \p steps cells each way, that has no original inside
/// the invertible disk: 0 without distortion. Milliseconds, where most has none.
double lost_share(const Camera& camera, int steps = 16);

/// More than this is no lens: calibrations of wide ones lose the corners.
inline constexpr double most_lost = 0.1;

}  // namespace polyhull
