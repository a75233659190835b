// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A plain ray tracer for tests of compositing: diffuse surfaces under one area light with even
/// ambient light, ideal mirrors with Schlick's Fresnel term, a subject that shows its own colour
/// unlit. Small enough to be read through; independent of what it judges.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/picture.h"
#include "base/thread_pool.h"
#include "picture_error.h"
#include "raytrace/ray_caster.h"
#include "scene/scene.h"

namespace polyhull::synthetic {

inline float to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}
inline float to_srgb(float c) {
  c = std::clamp(c, 0.0f, 1.0f);
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1.0f / 2.4f) - 0.055f;
}

class SimpleTrace {
 public:
  static constexpr int most_mirrors = 3;  ///< on the way of a ray

  SimpleTrace(const Scene& scene, const Vec3f& ambient) : scene_(scene), ambient_(ambient) {
    for (const SceneMesh& mesh : scene.meshes) caster_.add_mesh(mesh.positions, mesh.triangles);
    caster_.commit();
  }

  /// Adds the subject; \p colour gives its sRGB colour (0..1) at a scene point. It is seen by way of at
  /// most \p mirrors.
  void add_subject(const std::vector<Vec3f>& points, const std::vector<std::uint32_t>& triangles,
                   std::function<Vec3f(const Vec3f&)> colour, int mirrors = most_mirrors) {
    mirrors_ = mirrors;
    subject_ = caster_.add_mesh(points, triangles);
    caster_.commit();
    colour_ = std::move(colour);
  }

  /// The picture as RGBA; \p side * side samples of the light and as many of the pixel's area.
  Picture draw(const Camera& camera, int light_side, int pixel_side) const {
    Picture picture{camera.width, camera.height, 4, {}};
    picture.pixels.assign(static_cast<std::size_t>(camera.width) * camera.height * 4, 255);
    parallel_for(static_cast<std::size_t>(camera.height), 4, 0, [&](std::size_t a, std::size_t b) {
      for (std::size_t y = a; y < b; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          Vec3f sum(0.0f);
          for (int j = 0; j < pixel_side; ++j) {
            for (int i = 0; i < pixel_side; ++i) {
              const Vec2 p(x - 0.5 + (i + 0.5) / pixel_side,
                           static_cast<double>(y) - 0.5 + (j + 0.5) / pixel_side);
              const Vec3f value =
                  radiance({Vec3f(camera.centre()), 1e-3f, Vec3f(glm::normalize(camera.ray(p)))},
                           light_side, 0);
              sum += glm::min(value, Vec3f(1.0f));
            }
          }
          sum /= static_cast<float>(pixel_side * pixel_side);
          std::uint8_t* out = picture.row(static_cast<int>(y)) + 4 * x;
          for (int c = 0; c < 3; ++c)
            out[c] = static_cast<std::uint8_t>(std::lround(255.0f * to_srgb(sum[c])));
        }
      }
    });
    return picture;
  }

 private:
  /// Radiance times exposure.
  Vec3f radiance(const Ray& ray, int light_side, int depth) const {
    const RayHit hit = caster_.intersect(ray);
    if (!hit.hit()) return Vec3f(0.0f);
    const Vec3f point = ray.origin + hit.distance * ray.direction;
    if (hit.mesh == subject_ && depth > mirrors_)
      return radiance({point, 1e-3f, ray.direction}, light_side, depth);
    if (hit.mesh == subject_) {
      const Vec3f c = colour_(point);
      return {to_linear(c.x), to_linear(c.y), to_linear(c.z)};
    }
    const SceneMesh& mesh = scene_.meshes[hit.mesh];
    const Material& material = scene_.materials[static_cast<std::size_t>(mesh.material)];
    Vec3f normal = glm::normalize(hit.normal);
    if (glm::dot(normal, ray.direction) > 0.0f) normal = -normal;
    Vec3f irradiance = ambient_;
    for (const Light& light : scene_.lights) {
      const Vec3f light_normal = glm::normalize(glm::cross(light.u, light.v));
      const float area = 4.0f * glm::length(glm::cross(light.u, light.v));
      for (int j = 0; j < light_side; ++j) {
        for (int i = 0; i < light_side; ++i) {
          const float s =
              (2.0f * (static_cast<float>(i) + 0.5f)) / static_cast<float>(light_side) - 1.0f;
          const float t =
              (2.0f * (static_cast<float>(j) + 0.5f)) / static_cast<float>(light_side) - 1.0f;
          const Vec3f way = light.centre + s * light.u + t * light.v - point;
          const float distance = glm::length(way);
          const Vec3f direction = way / distance;
          const float cosines = std::max(0.0f, glm::dot(normal, direction)) *
                                std::max(0.0f, -glm::dot(light_normal, direction));
          if (cosines <= 0.0f) continue;
          if (caster_.occluded({point + 1e-4f * normal, 1e-4f, direction, distance - 1e-2f}))
            continue;
          irradiance += light.radiance * (cosines * area / (distance * distance) /
                                          static_cast<float>(light_side * light_side));
        }
      }
    }
    Vec3f out = material.emission;
    const Vec3f scattered = material.base_colour * irradiance / 3.14159265f;
    if (!material.is_mirror()) return scene_.exposure * (out + scattered);
    const float cosine = std::clamp(-glm::dot(ray.direction, normal), 0.0f, 1.0f);
    const Vec3f f0 = material.f0();
    const Vec3f fresnel = f0 + (1.0f - f0) * std::pow(1.0f - cosine, 5.0f);
    out += scattered * (1.0f - fresnel) * (1.0f - material.metallic);
    out *= scene_.exposure;
    if (depth < most_mirrors) {
      const Vec3f reflected = glm::reflect(ray.direction, normal);
      out += fresnel * radiance({point, 1e-3f, reflected}, light_side, depth + 1);
    }
    return out;
  }

  const Scene& scene_;
  Vec3f ambient_;
  RayCaster caster_;
  std::uint32_t subject_ = 0xfffffffeu;
  int mirrors_ = most_mirrors;
  std::function<Vec3f(const Vec3f&)> colour_;
};

}  // namespace polyhull::synthetic
