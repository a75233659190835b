// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/camera.h"

#include <algorithm>

#include "rig/lens.h"

namespace polyhull {

Vec3 Camera::centre() const {
  return -(glm::transpose(R) * t);
}

std::optional<Vec2> Camera::project_ideal(const Vec3& X) const {
  const Vec3 c = to_camera(X);
  if (!(c.z > 0.0)) return std::nullopt;
  const double x = c.x / c.z, y = c.y / c.z;
  return Vec2(K[0][0] * x + K[1][0] * y + K[2][0], K[1][1] * y + K[2][1]);
}

std::optional<Vec2> Camera::project(const Vec3& X) const {
  const std::optional<Vec2> ideal = project_ideal(X);
  if (!ideal) return std::nullopt;
  return distort(*ideal);
}

Vec3 Camera::ray(const Vec2& ideal) const {
  const double y = (ideal.y - K[2][1]) / K[1][1];
  const double x = (ideal.x - K[2][0] - K[1][0] * y) / K[0][0];
  return glm::transpose(R) * Vec3(x, y, 1.0);
}

Vec2 Camera::distort(const Vec2& ideal) const {
  return has_distortion() ? Distortion(*this).distort(ideal) : ideal;
}

Vec2 Camera::undistort(const Vec2& real) const {
  return has_distortion() ? Lens(*this).undistort(real) : real;
}

bool Camera::has_distortion() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0.0; });
}

}  // namespace polyhull
