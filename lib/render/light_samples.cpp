// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/light_samples.h"

#include <algorithm>
#include <cmath>

#include "scene/spot_cone.h"

namespace polyhull {
namespace {

struct Axes {
  Vec3 right, down, forward;
};

Axes axes_along(const Vec3& forward, const Light& light) {
  Vec3 aside(light.u);
  if (glm::length(glm::cross(aside, forward)) < 1e-6 * std::max(glm::length(aside), 1e-12))
    aside = std::abs(forward.x) < 0.7 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 down = glm::normalize(glm::cross(forward, aside));
  return {glm::normalize(glm::cross(down, forward)), down, forward};
}

/// A view along \p axes that holds tangents from low to high.
LightView make_view(const Vec3& position, const Axes& axes, const Vec2& low, const Vec2& high,
                    double near, double far) {
  LightView out;
  out.position = position;
  const Mat3 R = glm::transpose(Mat3(axes.right, axes.down, axes.forward));
  Mat4 view(R);
  view[3] = Vec4(-(R * position), 1.0);
  Mat4 clip(0.0);
  clip[0][0] = 2.0 / (high.x - low.x);
  clip[2][0] = -(high.x + low.x) / (high.x - low.x);
  clip[1][1] = 2.0 / (high.y - low.y);
  clip[2][1] = -(high.y + low.y) / (high.y - low.y);
  clip[2][2] = (far + near) / (far - near);
  clip[3][2] = -2.0 * far * near / (far - near);
  clip[2][3] = 1.0;
  out.clip_from_scene = clip * view;
  Mat4 half(0.5);
  half[3] = Vec4(0.5, 0.5, 0.5, 1.0);
  out.map_from_scene = half * out.clip_from_scene;
  out.inverse_from_depth = {-(far - near) / (far * near), 1.0 / near};
  return out;
}

}  // namespace

std::vector<Vec3> light_cells(const Light& light, int samples) {
  if (!light.is_area()) return {Vec3(light.centre)};
  const int side = std::max(1, static_cast<int>(std::lround(std::sqrt(samples))));
  std::vector<Vec3> cells;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double a = (2.0 * i + 1.0) / side - 1.0, b = (2.0 * j + 1.0) / side - 1.0;
      cells.push_back(Vec3(light.centre) + a * Vec3(light.u) + b * Vec3(light.v));
    }
  }
  return cells;
}

LightView view_of_points(const Light& light, const Vec3& position, int cells_per_side,
                         std::span<const Vec3f> points, double far, double nearest) {
  Vec3 middle(0.0);
  for (const Vec3f& p : points) middle += Vec3(p);
  middle /= std::max<double>(1.0, static_cast<double>(points.size()));
  Vec3 forward = middle - position;
  forward = glm::length(forward) > 1e-9 ? glm::normalize(forward) : Vec3(0, -1, 0);
  const Axes axes = axes_along(forward, light);
  constexpr double widest = 8.0;  // tangent; what lies beyond hardly reaches the light's front
  Vec2 low(widest), high(-widest);
  double near = far;
  for (const Vec3f& point : points) {
    const Vec3 d = Vec3(point) - position;
    const double z = glm::dot(d, axes.forward);
    if (z <= 1e-3) {
      low = Vec2(-widest), high = Vec2(widest), near = 1e-2;
      continue;
    }
    const Vec2 tangent(glm::dot(d, axes.right) / z, glm::dot(d, axes.down) / z);
    low = glm::min(low, tangent);
    high = glm::max(high, tangent);
    near = std::min(near, z);
  }
  low = glm::max(low, Vec2(-widest));
  high = glm::min(high, Vec2(widest));
  near = std::max(std::min(0.99 * near, nearest), 1e-2);
  far = std::max(far, 2.0 * near);
  // An offset d on the light, d_z of it forward, moves the shadow ray at the tangent t by
  // (d - t d_z) (1/z_blocker - 1/z_receiver) in tangents.
  const Vec3 u = Vec3(light.u) / static_cast<double>(cells_per_side);
  const Vec3 v = Vec3(light.v) / static_cast<double>(cells_per_side);
  const Vec2 forwards(glm::dot(u, axes.forward), glm::dot(v, axes.forward));
  const Vec2 farthest = glm::max(glm::abs(low), glm::abs(high));
  const Vec2 reach = (1.0 / near - 1.0 / far) *
                     (Vec2(std::abs(glm::dot(u, axes.right)) + std::abs(glm::dot(v, axes.right)),
                           std::abs(glm::dot(u, axes.down)) + std::abs(glm::dot(v, axes.down))) +
                      farthest * (std::abs(forwards.x) + std::abs(forwards.y)));
  // Empty texels around the subject, as far out as its penumbra reaches.
  const Vec2 border = 0.01 * (high - low) + 1e-4 + glm::min(reach, high - low);
  LightView view = make_view(position, axes, low - border, high + border, near, far);
  const Vec2 scale = 1.0 / (high - low + 2.0 * border);
  view.kernel = {glm::dot(u, axes.right) * scale.x, glm::dot(u, axes.down) * scale.y,
                 glm::dot(v, axes.right) * scale.x, glm::dot(v, axes.down) * scale.y};
  view.ahead = Vec4((border - low) * scale, forwards);
  return view;
}

LightView wide_view(const Light& light, const Vec3& position, const Vec3& target, double far) {
  Vec3 forward(light_normal(light));
  if (!light.is_area()) {
    forward = target - position;
    forward = glm::length(forward) > 1e-9 ? glm::normalize(forward) : Vec3(0, -1, 0);
  }
  constexpr double tangent = 3.732;  // of 75 degrees
  constexpr double near = 0.02;      // the lamp's own surface lies nearer
  return make_view(position, axes_along(forward, light), Vec2(-tangent), Vec2(tangent), near,
                   std::max(far, 1.0));
}

double light_given(const Light& light, const Vec3& point) {
  const Vec3 way = point - Vec3(light.centre);
  const double distance_2 = std::max(glm::dot(way, way), 1e-6);
  const double cosine = glm::dot(Vec3(light_normal(light)), way) / std::sqrt(distance_2);
  const double exit = light_exit(light, static_cast<float>(cosine));
  return light_strength(light) * exit / distance_2;
}

Vec3f light_normal(const Light& light) {
  return light.is_area() ? glm::normalize(glm::cross(light.u, light.v)) : Vec3f(0.0f);
}

Vec3f light_power(const Light& light) {
  return light.is_area() ? light.radiance * (4.0f * glm::length(glm::cross(light.u, light.v)))
                         : light.radiance;
}

float light_strength(const Light& light) {
  const Vec3f power = light_power(light);
  return power.x + power.y + power.z;
}

Vec3f share_of(const Vec3f& part, const Vec3f& whole) {
  Vec3f share(0.0f);
  for (int c = 0; c < 3; ++c)
    if (whole[c] > 0.0f) share[c] = part[c] / whole[c];
  return share;
}

float light_exit(const Light& light, float cosine) {
  if (!light.is_area()) return 1.0f;
  cosine = std::max(cosine, 0.0f);
  return light.is_spot() ? cone_of(light).at(cosine) : cosine;
}

}  // namespace polyhull
