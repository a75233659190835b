// SPDX-License-Identifier: LGPL-2.1-or-later
#include "scene/assumed_light.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "environment/environment.h"
#include "scene/gltf_lights.h"

namespace polyhull {
namespace {

constexpr double distance_of_sun = 100.0;  // scene sizes
constexpr double assumed_angle = 4.0;      // degrees: a shadow's edge is soft
constexpr double sun_by_sky = 2.0;         // irradiance of what faces the sun by that of the sky

}  // namespace

void set_sun(const Bounds& bounds, const Mat3& axes, const Vec3& irradiance, double degrees,
             Light& light) {
  const double distance = distance_of_sun * std::max(glm::length(bounds.max - bounds.min), 1e-3);
  const double half = distance * std::tan(glm::radians(degrees) / 2.0);
  light.centre = Vec3f(0.5 * (bounds.min + bounds.max) + distance * axes[2]);
  light.u = Vec3f(half * axes[1]);
  light.v = Vec3f(half * axes[0]);
  light.radiance = Vec3f(irradiance * distance * distance / (4.0 * half * half));
}

void assume_light(Scene& scene) {
  const Vec3 to_sun = glm::normalize(Vec3(0.5, 1.0, 0.6));
  const Vec3 x = glm::normalize(glm::cross(Vec3(0, 1, 0), to_sun));
  Light sun;
  sun.name = "assumed sun";
  set_sun(scene_bounds(scene), Mat3(x, glm::cross(to_sun, x), to_sun), Vec3(sun_by_sky),
          assumed_angle, sun);
  scene.lights.push_back(std::move(sun));
  scene.sky = Vec3f(std::numbers::inv_pi_v<float>);
  if (!scene.exposure_given) scene.exposure = automatic_exposure(scene);
}

void set_environment(std::shared_ptr<const Environment> environment, Scene& scene) {
  scene.environment = std::move(environment);
  scene.sky = Vec3f(1.0f);
  if (!scene.exposure_given) scene.exposure = automatic_exposure(scene);
}

std::vector<Light> environment_lights(const Scene& scene, std::size_t count) {
  std::vector<Light> lights;
  if (!scene.environment) return lights;
  const Bounds bounds = scene_bounds(scene);
  const Vec3 middle = 0.5 * (bounds.min + bounds.max);
  const double distance = distance_of_sun * std::max(glm::length(bounds.max - bounds.min), 1e-3);
  for (const EnvironmentPart& part : scene.environment->parts(count)) {
    const Vec3 to(part.direction), across(part.across);
    const Vec2 half = glm::tan(0.5 * Vec2(part.width));  // at distance 1
    // What a rectangle gives the place that it faces by its middle, per radiance: Lambert's formula (area_light.h).
    const auto edge = [](double a, double b) {
      return a / std::hypot(1.0, a) * std::atan(b / std::hypot(1.0, a));
    };
    const double seen = 2.0 * (edge(half.x, half.y) + edge(half.y, half.x));
    Light light;
    light.name = fmt::format("environment {}", lights.size() + 1);
    light.centre = Vec3f(middle + distance * to);
    light.u = Vec3f(distance * half.y * glm::cross(to, across));
    light.v = Vec3f(distance * half.x * across);
    light.radiance = part.irradiance / static_cast<float>(seen);
    light.soft = !part.is_sharp();
    lights.push_back(std::move(light));
  }
  return lights;
}

}  // namespace polyhull
