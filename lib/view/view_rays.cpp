// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/view_rays.h"

#include <algorithm>
#include <limits>
#include <numbers>

namespace polyhull {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr float least_throughput = 1.0f / 1024.0f;

}  // namespace

ViewRays::ViewRays(const TracedScene& scene, const LightCache& light, const Camera& camera,
                   const ViewOptions& options)
    : scene_(scene), light_(light), options_(options) {
  exposure_ = scene.scene().exposure;
  eye_ = Vec3f(camera.centre());
  if (camera.has_distortion()) lens_.emplace(camera);
  // Pinhole rays are linear in the pixel.
  corner_ = Vec3f(camera.ray({0.0, 0.0}));
  step_x_ = Vec3f(camera.ray({1.0, 0.0}) - camera.ray({0.0, 0.0}));
  step_y_ = Vec3f(camera.ray({0.0, 1.0}) - camera.ray({0.0, 0.0}));
}

Way ViewRays::way(float x, float y, std::uint32_t slot) const {
  Way out;
  if (lens_) {
    const Vec2 ideal = lens_->undistort({x, y});
    x = static_cast<float>(ideal.x);
    y = static_cast<float>(ideal.y);
  }
  out.ray.origin = eye_;
  out.ray.direction = corner_ + x * step_x_ + y * step_y_;
  out.dx = step_x_;
  out.dy = step_y_;
  out.throughput = Vec3f(1.0f);
  out.slot = slot;
  return out;
}

Way ViewRays::mirrored(const Way& way, const Mirror& mirror, const Vec3f& f) const {
  const Vec3f n = mirror.normal;
  Way out = way;
  out.throughput *= f;
  out.ray.direction = glm::reflect(way.ray.direction, n);
  out.ray.origin = way.ray.origin - 2.0f * (glm::dot(way.ray.origin, n) - mirror.offset) * n;
  const float distance =
      (mirror.offset - glm::dot(way.ray.origin, n)) / glm::dot(way.ray.direction, n);
  out.ray.near = distance + scene_.epsilon() / glm::length(out.ray.direction);
  out.dx = glm::reflect(way.dx, n);
  out.dy = glm::reflect(way.dy, n);
  return out;
}

std::uint64_t ViewRays::follow(RayWork& work, std::size_t count, int depth) const {
  std::fill_n(work.values.begin(), count, Vec3f(0.0f));
  std::uint64_t rays = 0;
  for (; count > 0; ++depth) {
    for (std::size_t i = 0; i < count; ++i) work.rays[i] = work.ways[i].ray;
    scene_.caster().intersect(std::span(work.rays).first(count), std::span(work.hits).first(count));
    rays += count;
    std::size_t onward = 0;
    for (std::size_t i = 0; i < count; ++i) {
      // Mirror ways are written in front of those still to read.
      Way next;
      if (shade(work.ways[i], work.hits[i], work.values[work.ways[i].slot], next) &&
          depth < options_.mirror_depth)
        work.ways[onward++] = next;
    }
    count = onward;
  }
  return rays;
}

/// Adds what a way sees to \p value; true if a mirror sends it on to \p next.
bool ViewRays::shade(const Way& way, const RayHit& hit, Vec3f& value, Way& next) const {
  if (!hit.hit()) {
    value += way.throughput * glm::min(exposure_ * scene_.sky(way.ray.direction), Vec3f(1.0f));
    return false;
  }
  if (scene_.is_subject(hit)) {
    value += way.throughput * scene_.subject_colour(hit, glm::normalize(way.ray.direction));
    return false;
  }
  const Surface surface = scene_.plain_surface(way.ray, hit);
  if (surface.emission != Vec3f(0.0f))
    value += way.throughput * glm::min(exposure_ * surface.emission, Vec3f(1.0f));
  const bool mirror = surface.material->is_mirror();
  Vec3f f(0.0f), diffuse(1.0f);
  if (mirror) {
    const float cosine =
        -glm::dot(surface.normal, way.ray.direction) / glm::length(way.ray.direction);
    f = fresnel(surface.material->f0(), cosine);
    diffuse = (Vec3f(1.0f) - f) * (1.0f - surface.material->metallic);
  }
  if (diffuse != Vec3f(0.0f)) {
    const Vec3f colour = scene_.base_colour(hit, way.ray.origin, way.ray.direction, way.dx, way.dy);
    value +=
        way.throughput * diffuse * colour * light_.irradiance(hit, surface.back) * (exposure_ / pi);
  }
  if (!mirror) return false;
  next.throughput = way.throughput * f;
  if (std::max({next.throughput.x, next.throughput.y, next.throughput.z}) < least_throughput)
    return false;
  const Vec3f n = surface.normal;
  next.slot = way.slot;
  next.ray.direction = glm::reflect(way.ray.direction, n);
  next.ray.origin = surface.point - hit.distance * next.ray.direction;
  next.ray.near = hit.distance + scene_.epsilon() / glm::length(next.ray.direction);
  next.ray.far = std::numeric_limits<float>::infinity();
  next.dx = glm::reflect(way.dx, n);
  next.dy = glm::reflect(way.dy, n);
  return true;
}

}  // namespace polyhull
