// SPDX-License-Identifier: LGPL-2.1-or-later
#include "mesh/world.h"

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace polyhull {

Mat4 scene_from_world(const Vec3& world_up, double metres_per_unit) {
  const Vec3 up = glm::normalize(world_up);
  const Vec3 y(0.0, 1.0, 0.0);
  const Vec3 axis = glm::cross(up, y);
  const double sine = glm::length(axis);
  const double cosine = glm::dot(up, y);
  Mat4 base(1.0);
  if (sine > 1e-12) {
    base = glm::rotate(base, std::atan2(sine, cosine), axis / sine);
  } else if (cosine < 0.0) {
    base = glm::rotate(base, std::acos(-1.0), Vec3(1.0, 0.0, 0.0));
  }
  return base * glm::scale(Mat4(1.0), Vec3(metres_per_unit));
}

}  // namespace polyhull
