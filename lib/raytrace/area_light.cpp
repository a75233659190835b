// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/area_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/spot_cone.h"

namespace polyhull {

float unoccluded_irradiance(const Light& light, const Vec3f& point, const Vec3f& normal) {
  if (!light.is_area()) return sample_light(light, {}, point, normal).weight;
  const Vec3f facing = glm::cross(light.u, light.v);
  if (glm::dot(facing, point - light.centre) <= 0.0f) return 0.0f;
  const Vec3f middle = light.centre - point;
  const std::array<Vec3f, 4> corners = {middle - light.u - light.v, middle + light.u - light.v,
                                        middle + light.u + light.v, middle - light.u + light.v};
  // Clipped against the horizon (Sutherland and Hodgman): at most five corners are left.
  std::array<Vec3f, 6> polygon;
  std::size_t count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3f& a = corners[i];
    const Vec3f& b = corners[(i + 1) % 4];
    const float height_a = glm::dot(a, normal), height_b = glm::dot(b, normal);
    if (height_a > 0.0f) polygon[count++] = a;
    if ((height_a > 0.0f) != (height_b > 0.0f))
      polygon[count++] = a + (height_a / (height_a - height_b)) * (b - a);
  }
  if (count < 3) return 0.0f;
  float sum = 0.0f;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f& a = polygon[i];
    const Vec3f& b = polygon[(i + 1) % count];
    const Vec3f across = glm::cross(a, b);
    const float sine = glm::length(across);
    if (sine <= 0.0f) continue;  // an edge that points at x subtends no angle
    sum += std::atan2(sine, glm::dot(a, b)) * glm::dot(across, normal) / sine;
  }
  return 0.5f * std::abs(sum);
}

LightSample sample_light(const Light& light, const Vec2f& square, const Vec3f& point,
                         const Vec3f& normal) {
  LightSample sample;
  const bool area = light.is_area();
  sample.place = light.centre;
  if (area) sample.place += (2.0f * square.x - 1.0f) * light.u + (2.0f * square.y - 1.0f) * light.v;
  const Vec3f way = sample.place - point;
  const float squared = glm::dot(way, way);
  const float towards = glm::dot(normal, way);
  if (!(squared > 0.0f) || towards <= 0.0f) return sample;
  const float distance = std::sqrt(squared);
  if (light.is_spot()) {
    const Vec3f facing = glm::cross(light.u, light.v);
    const float quarter = glm::length(facing);  // of the area
    const float cosine = -glm::dot(facing, way) / (quarter * distance);
    if (cosine <= 0.0f) return sample;
    sample.whole = 4.0f * quarter * towards / (squared * distance);
    sample.weight = sample.whole * cone_of(light).at(cosine);
    return sample;
  }
  if (area) {
    const float facing = -4.0f * glm::dot(glm::cross(light.u, light.v), way);  // area * cosine * r
    sample.weight = facing > 0.0f ? facing * towards / (squared * squared) : 0.0f;
  } else {
    sample.weight = towards / (squared * distance);
  }
  sample.whole = sample.weight;
  return sample;
}

}  // namespace polyhull
