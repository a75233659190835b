// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/mirror_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/srgb.h"
#include "render/light_samples.h"

namespace polyhull::processor {

Vec3f lamps_irradiance(const RenderFrame& frame, const Vec3f& point, const Vec3f& normal,
                       float least) {
  Vec3f irradiance = frame.ambient * frame.exposure;
  for (const Light& light : frame.lights) {
    const Vec3f to = light.centre - point;
    const float distance_2 = glm::dot(to, to);
    const Vec3f direction = to / std::sqrt(distance_2);
    const float exit = light_exit(light, -glm::dot(light_normal(light), direction));
    irradiance += light_power(light) * frame.exposure *
                  (std::max(glm::dot(normal, direction), least) * exit / distance_2);
  }
  return irradiance;
}

MirrorView::MirrorView(const RenderFrame& frame, const RenderPlan& plan, const SeenMirror& seen,
                       const TracedScene& scene, const SceneLayer& mirrored,
                       std::vector<std::uint8_t>& ways, const std::uint8_t* background, int stride,
                       AlphaCoding alpha)
    : frame_(frame),
      scene_(scene),
      mirrored_(mirrored),
      ways_(ways),
      part_(seen.seen),
      background_(background),
      stride_(stride),
      alpha_(alpha),
      surfaces_(surfaces_of(*frame.scene, seen)) {
  pixels_from_scene_ = pixels_from_clip(frame.width, frame.height) * plan.clip_from_scene;
  eye_ = Vec3f(plan.eye);
  mirrored_eye_ = Vec3f(seen.eye);
  only_mirrors_ = polyhull::only_mirrors(*frame.scene, seen);
  rays_ = PixelRays(resized(frame.viewport, frame.width, frame.height));
}

Vec3f MirrorView::share(int x, int y) const {
  const Vec3f way = glm::normalize(rays_.at(x, y));
  Vec3f share = fresnel(surfaces_[0].f0, -glm::dot(way, surfaces_[0].normal));
  for (std::size_t i = 1; i < surfaces_.size(); ++i)
    share *= fresnel(surfaces_[i].f0, -glm::dot(way, surfaces_[i].normal));
  return share;
}

/// The direction in which the mirrors send what is seen at pixel (x, y).
Vec3f MirrorView::mirrored_way(int x, int y) const {
  Vec3f way = rays_.at(x, y);
  // As the mirrors seem to stand, the last one comes first.
  for (std::size_t i = surfaces_.size(); i-- > 0;) way = glm::reflect(way, surfaces_[i].normal);
  return way;
}

/// What the background has at \p point. \p way to it: whether that is known, and something stands in it.
Vec3f MirrorView::looked_up(const Vec3f& point, std::uint8_t& way, bool& found) const {
  constexpr std::uint8_t open = 1, blocked = 2;
  found = false;
  const Vec4 at = pixels_from_scene_ * Vec4(Vec3(point), 1.0);
  if (!(at.z > 0.0)) return Vec3f(0.0f);
  const double u = at.x / at.z - 0.5, v = at.y / at.z - 0.5;
  if (!(u >= 0.0 && v >= 0.0 && u <= frame_.width - 1 && v <= frame_.height - 1))
    return Vec3f(0.0f);
  // What stands before the point is another thing; up to half a percent of the way may be itself.
  if (way == 0) {
    Ray ray;
    ray.origin = eye_;
    ray.direction = point - eye_;
    ray.far = 0.995f;
    way = scene_.caster().occluded(ray) ? blocked : open;
  }
  if (way == blocked) return Vec3f(0.0f);
  const int x = std::min(static_cast<int>(u), std::max(frame_.width - 2, 0));
  const int y = std::min(static_cast<int>(v), std::max(frame_.height - 2, 0));
  const auto there = [&](int i, int j) {
    return background_ + static_cast<std::ptrdiff_t>(std::min(j, frame_.height - 1)) * stride_ +
           4 * static_cast<std::ptrdiff_t>(std::min(i, frame_.width - 1));
  };
  if (alpha_ != AlphaCoding::ignored &&
      (there(x, y)[3] & there(x + 1, y)[3] & there(x, y + 1)[3] & there(x + 1, y + 1)[3]) != 255)
    return Vec3f(0.0f);
  found = true;
  const auto a = static_cast<float>(u - x), b = static_cast<float>(v - y);
  const float* const linear = srgb_to_linear_table();
  const auto pixel = [&](int i, int j) {
    const std::uint8_t* p = there(i, j);
    return Vec3f(linear[p[0]], linear[p[1]], linear[p[2]]);
  };
  return (1.0f - b) * ((1.0f - a) * pixel(x, y) + a * pixel(x + 1, y)) +
         b * ((1.0f - a) * pixel(x, y + 1) + a * pixel(x + 1, y + 1));
}

Vec3f MirrorView::shown(int x, int y) const {
  const RayHit hit = mirrored_.hit(x, y);
  if (!hit.hit())
    return glm::min(sky_radiance(*frame_.scene, frame_.sky, mirrored_way(x, y)) * frame_.exposure,
                    Vec3f(1.0f));
  Ray ray;
  ray.origin = mirrored_eye_;
  ray.direction = Vec3f(0.0f);
  Surface surface = scene_.plain_surface(ray, hit);
  const Vec3f way = surface.point - mirrored_eye_;
  const Material& material = *surface.material;
  if (!material.is_mirror()) {  // these look different from elsewhere
    bool found = false;
    const std::size_t pixel = static_cast<std::size_t>(y - part_.y) * part_.width + (x - part_.x);
    const Vec3f value = looked_up(surface.point, ways_[pixel], found);
    if (found) return value;
  }
  Vec3f normal = surface.normal;
  if (glm::dot(normal, way) > 0.0f) normal = -normal;
  const Vec3f irradiance = lamps_irradiance(frame_, surface.point, normal);
  Vec3f albedo = scene_.base_colour(hit);
  if (material.is_mirror()) {
    const float cosine = std::abs(glm::dot(normal, glm::normalize(way)));
    albedo *= (Vec3f(1.0f) - fresnel(material.f0(), cosine)) * (1.0f - material.metallic);
  }
  return glm::min(
      albedo * irradiance / std::numbers::pi_v<float> + material.emission * frame_.exposure,
      Vec3f(1.0f));
}

}  // namespace polyhull::processor
