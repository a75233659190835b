// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/albedo_layer.h"

#include <algorithm>
#include <cmath>

namespace polyhull::processor {
namespace {

Vec3f albedo(const TracedScene& scene, const RayHit& hit, const Vec3f& eye) {
  if (!hit.hit()) return Vec3f(0.0f);
  Ray ray;
  ray.origin = eye;
  const Surface surface = scene.plain_surface(ray, hit);
  const Vec3f colour = scene.base_colour(hit);
  const Material& material = *surface.material;
  if (!material.is_mirror()) return colour;
  const float cosine = std::abs(glm::dot(surface.normal, glm::normalize(surface.point - eye)));
  return colour * (Vec3f(1.0f) - fresnel(material.f0(), cosine)) * (1.0f - material.metallic);
}

}  // namespace

void AlbedoLayer::reset(const SceneLayer& layer) {
  known_.assign(
      static_cast<std::size_t>(layer.view().width) * static_cast<std::size_t>(layer.view().height),
      0);
}

std::uint64_t AlbedoLayer::at(const TracedScene& scene, const SceneLayer& layer, const Vec3f& eye,
                              int x, int y) {
  std::uint64_t& known =
      known_[static_cast<std::size_t>(y) * static_cast<std::size_t>(layer.view().width) + x];
  if (known == 0) {
    const Vec3f value = albedo(scene, layer.hit(x, y), eye);
    known = std::uint64_t{1} << 48;
    for (int k = 0; k < 3; ++k)
      known |= static_cast<std::uint64_t>(std::clamp(value[k], 0.0f, 1.0f) * 65535.0f + 0.5f)
               << (16 * k);
  }
  return known;
}

}  // namespace polyhull::processor
