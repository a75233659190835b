// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/lamp_share.h"

#include <algorithm>
#include <array>

#include "environment/environment.h"
#include "raytrace/area_light.h"
#include "raytrace/sampling.h"

namespace polyhull {
namespace {

constexpr std::size_t spot_ways = 64;  // to a spot, whose light has no closed form
constexpr std::uint32_t straight_seed = 0x3c6ef372U, mirrored_seed = 0x510e527fU,
                        inside_seed = 0xa54ff53aU, environment_seed = 0x1f83d9abU;

}  // namespace

std::vector<Vec2f> spread_points(int count, std::uint32_t seed) {
  constexpr int most = 1024;
  std::vector<Vec2f> points;
  for (int i = 0; i < std::clamp(count, 1, most); ++i)
    points.push_back(sample_point(static_cast<std::uint32_t>(i), seed));
  return points;
}

bool inside_a_body(const TracedScene& scene, const SurfaceGrid::Node& node) {
  const auto [x, y] = tangents(node.normal);
  int backs = 0;
  constexpr std::uint32_t count = 8;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3f local = cosine_direction(sample_point(i, inside_seed));
    Ray ray;
    ray.origin = ray_start(scene, node);
    ray.near = 10.0f * scene.epsilon();
    ray.direction = local.x * x + local.y * y + local.z * node.normal;
    const RayHit hit = scene.caster().intersect(ray);
    if (!hit.hit()) continue;
    const Material& material = scene.scene().materials[scene.scene().meshes[hit.mesh].material];
    if (!material.double_sided && glm::dot(hit.normal, ray.direction) > 0.0f) ++backs;
  }
  return 2 * backs > static_cast<int>(count);
}

LampShare::LampShare(const TracedScene& scene, const Light& light, const MirroredLight* mirrored,
                     int first, int samples)
    : scene_(scene),
      light_(mirrored != nullptr ? mirrored->image : light),
      mirrored_(mirrored),
      radiance_(light_.radiance),
      points_(spread_points(light.is_area() ? samples : 1,
                            mirrored != nullptr ? mirrored_seed : straight_seed)),
      first_(std::min(points_.size(), static_cast<std::size_t>(std::max(first, 1)))) {}

LampShare::LampShare(const TracedScene& scene, int first, int samples)
    : scene_(scene),
      radiance_(scene.scene().sky),
      first_(static_cast<std::size_t>(std::clamp(first, 1, samples))) {
  for (const Vec2f& point : spread_points(samples, environment_seed)) {
    const EnvironmentSample sample = scene.scene().environment->sample(point);
    const float weight = sample.density > 0.0f ? 1.0f / sample.density : 0.0f;
    ways_.push_back({sample.direction, to_float4(weight * sample.radiance)});
  }
  first_ = std::min(first_, ways_.size());
}

std::optional<Vec3f> LampShare::unoccluded(const SurfaceGrid::Node& node) const {
  if (is_environment()) return radiance_ * scene_.scene().environment->irradiance(node.normal);
  const float irradiance = light_per_radiance(node);
  if (irradiance <= 0.0f) return {};
  return radiance_ * irradiance;
}

/// E / L of unoccluded().
float LampShare::light_per_radiance(const SurfaceGrid::Node& node) const {
  const Vec3f origin = ray_start(scene_, node);
  if (!light_.is_spot()) return unoccluded_irradiance(light_, origin, node.normal);
  const std::size_t count = std::min(points_.size(), spot_ways);
  float sum = 0.0f;
  for (std::size_t i = 0; i < count; ++i)
    sum += sample_light(light_, points_[i], origin, node.normal).whole;
  return sum / static_cast<float>(count);
}

void LampShare::add(const SurfaceGrid::Node& node, std::span<const Vec2f> points, Sum& sum) const {
  std::array<Ray, 64> rays;
  std::array<float, 64> weights, wholes;
  std::array<std::uint8_t, 64> blocked;
  const Vec3f origin = ray_start(scene_, node);
  for (std::size_t first = 0; first < points.size(); first += rays.size()) {
    std::size_t count = 0;
    for (std::size_t i = first; i < std::min(first + rays.size(), points.size()); ++i) {
      const LightSample sample = sample_light(light_, points[i], origin, node.normal);
      if (sample.whole <= 0.0f) continue;
      if (sample.weight <= 0.0f) {  // beyond a spot's cone
        sum.whole += sample.whole;
        sum.blocked = true;
        continue;
      }
      wholes[count] = sample.whole;
      weights[count] = sample.weight;
      rays[count].origin = origin;
      rays[count].direction = sample.place - origin;
      // A node in the very plane of a wall that stands there is on the wall's near side, too.
      rays[count].near = 10.0f * scene_.epsilon() / glm::length(rays[count].direction);
      rays[count].far = 1.0f - 1e-4f;
      ++count;
    }
    scene_.caster().occluded(std::span(rays).first(count), std::span(blocked).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      sum.whole += wholes[i];
      if (!blocked[i]) sum.visible += Float4{weights[i], weights[i], weights[i], 0.0f};
      (blocked[i] ? sum.blocked : sum.free) = true;
    }
  }
}

/// By \p count of ways_.
void LampShare::add_environment(const SurfaceGrid::Node& node, std::size_t first, std::size_t count,
                                Sum& sum) const {
  std::array<Ray, 64> rays;
  std::array<Float4, 64> lights;
  std::array<std::uint8_t, 64> blocked;
  const Vec3f origin = ray_start(scene_, node);
  const std::size_t end = first + count;
  while (first < end) {
    std::size_t asked = 0;
    for (; first < end && asked < rays.size(); ++first) {
      const float cosine = glm::dot(node.normal, ways_[first].direction);
      if (cosine <= 0.0f) continue;
      lights[asked] = cosine * ways_[first].light;
      rays[asked] = {origin, 10.0f * scene_.epsilon(), ways_[first].direction};
      ++asked;
    }
    scene_.caster().occluded(std::span(rays).first(asked), std::span(blocked).first(asked), false);
    for (std::size_t i = 0; i < asked; ++i) {
      sum.whole += lights[i];
      if (!blocked[i]) sum.visible += lights[i];
      (blocked[i] ? sum.blocked : sum.free) = true;
    }
  }
}

void LampShare::add_mirrored(const SurfaceGrid::Node& node, std::span<const Vec2f> points,
                             Sum& sum) const {
  const Vec3f origin = ray_start(scene_, node);
  for (const Vec2f& point : points) {
    const LightSample sample = sample_light(light_, point, origin, node.normal);
    if (sample.whole <= 0.0f) continue;
    const Vec3f share = mirrored_share(scene_, *mirrored_, point, origin, node.normal);
    sum.whole += sample.whole;
    sum.visible += to_float4(sample.weight * share);
    (share == Vec3f(0.0f) ? sum.blocked : sum.free) = true;
  }
}

Float4 LampShare::at(const SurfaceGrid::Node& node, bool thorough, std::uint64_t& rays) const {
  Sum sum;
  const std::uint64_t each = mirrored_ != nullptr ? 2 : 1;
  const auto ask = [&](std::size_t first, std::size_t count) {
    if (is_environment())
      add_environment(node, first, count, sum);
    else if (mirrored_ != nullptr)
      add_mirrored(node, std::span(points_).subspan(first, count), sum);
    else
      add(node, std::span(points_).subspan(first, count), sum);
    rays += each * count;
  };
  const std::size_t all_ways = is_environment() ? ways_.size() : points_.size();
  ask(0, first_);
  const bool soft = sum.blocked && sum.free;
  const auto any = [](const Float4& v) { return v[0] > 0.0f || v[1] > 0.0f || v[2] > 0.0f; };
  if ((soft || thorough) && any(sum.whole)) ask(first_, all_ways - first_);
  // A node that the light's front is turned away from does as if it saw it: the light's closed form
  // is 0 there, and a neighbour's share is not disturbed. So does a colour that nothing has.
  constexpr Float4 all = {1.0f, 1.0f, 1.0f, 0.0f};
  if (!any(sum.whole)) return all;
  const Float4 nothing{};
  const Float4 share = sum.whole > nothing ? sum.visible / sum.whole : all;
  return share < all ? share : all;
}

}  // namespace polyhull
