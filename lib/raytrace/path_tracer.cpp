// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/srgb.h"
#include "base/thread_pool.h"
#include "environment/environment.h"
#include "raytrace/area_light.h"
#include "raytrace/sampling.h"
#include "rig/lens.h"

namespace polyhull {
namespace {

constexpr float least_throughput =
    1e-3f;  // a mirror image fainter than this shows in no 8-bit picture

float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

/// One path's random points: a new pair of dimensions each time.
struct Points {
  std::uint32_t index;
  std::uint32_t seed;
  Vec2f next() {
    seed = hash(seed);
    return sample_point(index, seed);
  }
};

/// As environment_sample(), by way of planar mirror \p number of the scene.
Vec3f mirrored_environment_sample(const TracedScene& scene, std::size_t number, const Vec2f& square,
                                  const Vec3f& origin, const Vec3f& normal) {
  const Mirror& mirror = scene.scene().mirrors[number];
  const EnvironmentSample sample = scene.scene().environment->sample(square);
  const Vec3f way = glm::reflect(sample.direction, mirror.normal);
  const float cosine = glm::dot(normal, way);
  if (!(sample.density > 0.0f) || cosine <= 0.0f || glm::dot(mirror.normal, way) >= 0.0f ||
      glm::dot(mirror.normal, origin) - mirror.offset <= scene.epsilon())
    return Vec3f(0.0f);
  MirroredLight far{0, number, {}};                          // as the mirror shows it
  far.image.centre = origin + 5e6f * scene.epsilon() * way;  // a hundred scenes away
  return scene.scene().sky * sample.radiance * (cosine / sample.density) *
         mirrored_share(scene, far, {}, origin, normal);
}

class Tracer {
 public:
  Tracer(const TracedScene& scene, const PathOptions& options) : scene_(scene), options_(options) {
    exposure_ = scene.scene().exposure;
  }

  /// Linear picture value along a camera ray.
  Vec3f picture_value(Ray ray, Points points) const {
    Vec3f value(0.0f), throughput(1.0f);
    for (int depth = 0; depth <= options_.mirror_depth; ++depth) {
      const RayHit hit = scene_.caster().intersect(ray);
      if (!hit.hit()) {
        value += throughput * glm::min(exposure_ * scene_.sky(ray.direction), Vec3f(1.0f));
        break;
      }
      if (scene_.is_subject(hit)) {
        value += throughput * scene_.subject_colour(hit, glm::normalize(ray.direction));
        break;
      }
      const Surface surface = scene_.surface(ray, hit);
      value += throughput * glm::min(exposure_ * surface.emission, Vec3f(1.0f));
      if (!surface.material->is_mirror()) {
        value += throughput * scene_.base_colour(hit) *
                 (exposure_ / std::numbers::pi_v<float>)*irradiance(surface, points);
        break;
      }
      const Vec3f f = reflectance(surface, ray);
      const Vec3f diffuse = (Vec3f(1.0f) - f) * (1.0f - surface.material->metallic);
      if (largest(diffuse) > 0.0f) {
        value += throughput * diffuse * scene_.base_colour(hit) *
                 (exposure_ / std::numbers::pi_v<float>)*irradiance(surface, points);
      }
      throughput *= f;
      if (largest(throughput) < least_throughput) break;
      ray = reflected(ray, surface);
    }
    return value;
  }

 private:
  static Vec3f reflectance(const Surface& surface, const Ray& ray) {
    return fresnel(surface.material->f0(),
                   -glm::dot(surface.normal, ray.direction) / glm::length(ray.direction));
  }

  Ray reflected(const Ray& ray, const Surface& surface) const {
    Ray out;
    out.direction = glm::reflect(ray.direction, surface.normal);
    // At grazing angles a smoothed normal may send the ray into the body.
    if (glm::dot(out.direction, surface.geometric) <= 0.0f)
      out.direction = glm::reflect(ray.direction, surface.geometric);
    out.origin = surface.point + scene_.epsilon() * surface.geometric;
    return out;
  }

  Vec3f start(const Surface& surface) const {
    return surface.lifted + scene_.epsilon() * surface.geometric;
  }

  Vec3f irradiance(const Surface& surface, Points& points) const {
    Vec3f direct(0.0f), bounced(0.0f);
    const auto light_samples = static_cast<std::uint32_t>(options_.light_samples);
    const auto bounce_samples = static_cast<std::uint32_t>(options_.bounce_samples);
    const Vec3f origin = start(surface);
    for (const Light& light : scene_.scene().lights) {
      points.seed = hash(points.seed);
      for (std::uint32_t k = 0; k < light_samples; ++k) {
        direct +=
            light_sample(scene_, light, sample_point(points.index * light_samples + k, points.seed),
                         origin, surface.normal);
      }
    }
    for (const MirroredLight& light : scene_.mirrored_lights()) {
      points.seed = hash(points.seed);
      for (std::uint32_t k = 0; k < light_samples; ++k) {
        direct += mirrored_light_sample(scene_, light,
                                        sample_point(points.index * light_samples + k, points.seed),
                                        origin, surface.normal);
      }
    }
    if (scene_.scene().environment) {
      const auto add = [&](const auto& sampled) {
        points.seed = hash(points.seed);
        for (std::uint32_t k = 0; k < light_samples; ++k)
          direct += sampled(sample_point(points.index * light_samples + k, points.seed));
      };
      add([&](const Vec2f& square) {
        return environment_sample(scene_, square, origin, surface.normal);
      });
      for (std::size_t m = 0; m < scene_.scene().mirrors.size(); ++m)
        add([&](const Vec2f& square) {
          return mirrored_environment_sample(scene_, m, square, origin, surface.normal);
        });
    }
    points.seed = hash(points.seed);
    const auto [x, y] = tangents(surface.normal);
    for (std::uint32_t k = 0; k < bounce_samples; ++k) {
      const std::uint32_t index = points.index * bounce_samples + k;
      const Vec3f local = cosine_direction(sample_point(index, points.seed));
      Ray ray;
      ray.direction = local.x * x + local.y * y + local.z * surface.normal;
      ray.origin = origin;
      bounced += bounce(ray, Points{index, hash(points.seed, 0xb5297a4dU)});
    }
    return direct / static_cast<float>(light_samples) +
           bounced * (std::numbers::pi_v<float> / static_cast<float>(bounce_samples));
  }

  /// L_1 along a ray from a diffuse point.
  Vec3f bounce(Ray ray, Points points) const {
    Vec3f radiance(0.0f), throughput(1.0f);
    bool planar = true;  // lights seen directly or in one planar mirror are sampled as lights
    bool front = true;   // and so is the environment, in the side that a mirror faces
    for (int depth = 0; depth <= options_.mirror_depth; ++depth) {
      const RayHit hit = scene_.caster().intersect(ray);
      if (!hit.hit()) {
        if (depth > 1 || !front || !scene_.scene().environment)
          radiance += throughput * scene_.sky(ray.direction);
        break;
      }
      if (scene_.is_subject(hit)) {
        radiance +=
            throughput / exposure_ * scene_.subject_colour(hit, glm::normalize(ray.direction));
        break;
      }
      const Surface surface = scene_.surface(ray, hit);
      if (surface.light < 0 || depth > 1 || !planar) radiance += throughput * surface.emission;
      const bool mirror = surface.material->is_mirror();
      const Vec3f f = mirror ? reflectance(surface, ray) : Vec3f(0.0f);
      const Vec3f diffuse = (Vec3f(1.0f) - f) * (mirror ? 1.0f - surface.material->metallic : 1.0f);
      if (largest(diffuse) > 0.0f) {
        Vec3f direct(0.0f);
        for (const Light& light : scene_.scene().lights)
          direct += light_sample(scene_, light, points.next(), start(surface), surface.normal);
        if (scene_.scene().environment)
          direct += environment_sample(scene_, points.next(), start(surface), surface.normal);
        radiance +=
            throughput * diffuse * scene_.base_colour(hit) / std::numbers::pi_v<float> * direct;
      }
      if (!mirror) break;
      planar = scene_.is_planar_mirror(hit.mesh);
      front = planar && !surface.back;
      throughput *= f;
      if (largest(throughput) < least_throughput) break;
      ray = reflected(ray, surface);
    }
    return radiance;
  }

  const TracedScene& scene_;
  const PathOptions& options_;
  float exposure_;
};

}  // namespace

void trace_paths(const TracedScene& scene, const Camera& camera, std::uint32_t first,
                 std::uint32_t count, const PathOptions& options, std::span<Vec3f> sums,
                 int row_begin, int row_end) {
  const Tracer tracer(scene, options);
  const Vec3f eye(camera.centre());
  const Vec3f right(glm::transpose(camera.R)[0]), down(glm::transpose(camera.R)[1]);
  std::optional<Lens> lens;  // one for all rays: to make it takes far longer than a ray's use of it
  if (camera.has_distortion()) lens.emplace(camera);
  const auto width = static_cast<std::size_t>(camera.width);
  const auto first_row = static_cast<std::size_t>(row_begin);
  const std::size_t rows =
      static_cast<std::size_t>(row_end < 0 ? camera.height : row_end) - first_row;
  parallel_for(rows, 2, options.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = (first_row + begin) * width; i < (first_row + end) * width; ++i) {
      const std::uint32_t seed = hash(static_cast<std::uint32_t>(i), 0x1b56c4e9U);
      for (std::uint32_t k = first; k < first + count; ++k) {
        Points points{k, seed};
        const Vec2f place = points.next();
        Vec2 pixel(static_cast<double>(i % width) + place.x - 0.5,
                   static_cast<double>(i / width) + place.y - 0.5);
        if (lens) pixel = lens->undistort(pixel);
        Ray ray;
        ray.origin = eye;
        ray.direction = Vec3f(camera.ray(pixel));
        if (options.aperture > 0.0f) {
          const Vec3f disk = cosine_direction(points.next());  // its x and y are even on the disk
          const Vec3f off = 0.5f * options.aperture * (disk.x * right + disk.y * down);
          ray.origin += off;
          ray.direction -= off / options.focus_distance;
        }
        sums[i] += tracer.picture_value(ray, points);
      }
    }
  });
}

Picture develop(std::span<const Vec3f> sums, float samples, int width, int height) {
  Picture picture{width, height, 4, std::vector<std::uint8_t>(4 * sums.size())};
  const float scale = 1.0f / samples;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    for (int k = 0; k < 3; ++k) picture.pixels[4 * i + k] = linear_to_srgb(scale * sums[i][k]);
    picture.pixels[4 * i + 3] = 255;
  }
  return picture;
}

Picture trace_picture(const TracedScene& scene, const Camera& camera, std::uint32_t samples,
                      const PathOptions& options) {
  std::vector<Vec3f> sums(static_cast<std::size_t>(camera.width) * camera.height, Vec3f(0.0f));
  trace_paths(scene, camera, 0, samples, options, sums);
  return develop(sums, static_cast<float>(samples), camera.width, camera.height);
}

}  // namespace polyhull
