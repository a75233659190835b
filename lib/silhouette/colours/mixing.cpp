// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/colours/mixing.h"

#include <algorithm>

#include "base/srgb.h"

namespace polyhull::silhouette {
namespace {

float squared_distance(const Vec3f& p, const Vec3f& a, const Vec3f& b) {
  const Vec3f along = b - a;
  const float length = glm::dot(along, along);
  const float t = length > 0.0f ? std::clamp(glm::dot(p - a, along) / length, 0.0f, 1.0f) : 0.0f;
  const Vec3f away = p - a - t * along;
  return glm::dot(away, away);
}

}  // namespace

Vec3f mixed_in_light(const Vec3f& screen, const Vec3f& subject, float alpha) {
  const Vec3f light =
      glm::mix(srgb_decoded(screen / 255.0f), srgb_decoded(subject / 255.0f), alpha);
  return 255.0f * Vec3f(srgb_encoded(light.x), srgb_encoded(light.y), srgb_encoded(light.z));
}

void Mixing::add(const Vec3f& screen, const Vec3f& subject, const Vec3f& pixel, double noise) {
  const auto away = static_cast<float>(2.0 + noise), most = 100.0f + 16.0f * away * away;
  auto& [from, to, complete, points] = curve_;
  if (from != screen || to != subject) {
    from = screen, to = subject, complete = false;
    points[pieces / 2] = mixed_in_light(screen, subject, 0.5f);
  }
  if (squared_distance(points[pieces / 2], screen, subject) < away * away) return;
  if (!complete) {
    for (int i = 1; i <= pieces; ++i)
      points[i] = mixed_in_light(screen, subject, static_cast<float>(i) / pieces);
    points[0] = screen;
    complete = true;
  }
  const float numbers = squared_distance(pixel, screen, subject);
  float light = 1e9f;
  for (int i = 0; i < pieces; ++i)
    light = std::min(light, squared_distance(pixel, points[i], points[i + 1]));
  // Another colour of the subject is far from both.
  if (std::min(numbers, light) > most) return;
  ++frame_.count;
  frame_.light += std::min(light, most);
  frame_.numbers += std::min(numbers, most);
}

void Mixing::finish_frame() {
  if (frame_.count >= least && frame_.count > most_.count) most_ = frame_;
  frame_ = {};
}

}  // namespace polyhull::silhouette
