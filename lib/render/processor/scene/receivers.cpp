// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/scene/receivers.h"

#include <cmath>

namespace polyhull::processor {

void ReceiverFinder::look_at(std::uint32_t number, const Vec3f& direction) {
  number_ = number;
  const SceneLayer::Triangle shown = layer_.triangle(layer_.piece(number));
  for (int k = 0; k < 3; ++k) corner_[k] = shown.of->positions[shown.corner[k]];
  const Vec3f geometric =
      glm::normalize(glm::cross(corner_[1] - corner_[0], corner_[2] - corner_[0]));
  flat_ = true;
  for (int k = 0; k < 3; ++k)
    flat_ = flat_ &&
            glm::dot(glm::normalize(shown.of->normals[shown.corner[k]]), geometric) > 1.0f - 1e-6f;
  // All of a plane shows the eye one side.
  normal_ = glm::dot(geometric, direction) > 0.0f ? -geometric : geometric;
  above_ = scene_.epsilon() * normal_;
}

Receiver ReceiverFinder::at(int x, int y, const Vec3f& direction) {
  const std::uint32_t number = *layer_.middle_piece(x, y);
  if (number != number_) look_at(number, direction);
  if (flat_) {
    const Foot at = foot(layer_.piece(number), x + 0.5, y + 0.5);
    const float first = 1.0f - at.second - at.third;
    return {first * corner_[0] + at.second * corner_[1] + at.third * corner_[2] + above_, normal_};
  }
  Ray ray;
  ray.origin = eye_;
  ray.direction = direction;
  const Surface surface = scene_.surface(ray, layer_.hit(x, y));
  return {surface.lifted + scene_.epsilon() * surface.geometric, surface.normal};
}

}  // namespace polyhull::processor
