// SPDX-License-Identifier: LGPL-2.1-or-later
// Lights as people change them.
#include <algorithm>
#include <cmath>

#include "base/rotation.h"
#include "scene/changes/light_places.h"
#include "scene/changes/named_parts.h"
#include "scene/changes/scene_changes.h"
#include "scene/drawable.h"

namespace polyhull {
namespace {

constexpr float least_side = 1e-6f;  // metres; of smaller lamps nothing tells which way they face
constexpr float most_radiance = 1e20f, most_away = 1e8f;
constexpr double far_away = 50.0;  // scene sizes: only suns are so far

Vec3 middle_of(const Bounds& bounds) {
  return 0.5 * (bounds.min + bounds.max);
}

}  // namespace

bool is_sun(const Light& light, const Bounds& bounds) {
  return is_beyond(light, bounds, far_away);
}

Vec3f around(const Mat3& turn, const Bounds& bounds, const Vec3f& point) {
  const Vec3 middle = middle_of(bounds);
  return Vec3f(middle + turn * (Vec3(point) - middle));
}

void hold(Light& light) {
  light.radiance = glm::min(light.radiance, Vec3f(most_radiance));
  for (Vec3f* v : {&light.centre, &light.u, &light.v})
    *v = glm::clamp(*v, Vec3f(-most_away), Vec3f(most_away));
}

namespace {

void apply(const LightChange& change, const Bounds& bounds, Light& light) {
  if (change.colour)
    light.radiance =
        std::max({light.radiance.x, light.radiance.y, light.radiance.z}) * *change.colour;
  light.radiance *= change.intensity;
  if (light.is_area() && change.size != 1.0f) {
    const float sides = std::min(glm::length(light.u), glm::length(light.v));
    const float size = std::max(change.size, std::min(least_side / sides, 1.0f));
    light.u *= size;
    light.v *= size;
    light.radiance /= size * size;
  }
  if (change.turn != Vec3f(0.0f)) {
    const Mat3 turn(rotation_of(change.turn));
    if (is_sun(light, bounds)) light.centre = around(turn, bounds, light.centre);
    light.u = Vec3f(turn * Vec3(light.u));
    light.v = Vec3f(turn * Vec3(light.v));
  }
  light.centre += change.move;
  hold(light);
}

/// Whether light \p index, called \p name, is meant.
bool is_meant(const LightChange& change, std::size_t index, const std::string& name) {
  if (change.light == name) return true;
  return !change.quoted && (change.light == "*" || change.light == std::to_string(index + 1));
}

}  // namespace

std::string change_lights(const std::vector<LightChange>& changes, const Bounds& bounds,
                          const std::string& scene, std::vector<Light>& lights) {
  std::string missing;
  for (const LightChange& change : changes) {
    bool found = false;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      if (!is_meant(change, i, lights[i].name)) continue;
      found = true;
      apply(change, bounds, lights[i]);
    }
    if (!found) add_missing(missing, change.light);
  }
  if (missing.empty()) return {};
  std::vector<std::string> there;
  for (const Light& light : lights) there.push_back(light.name);
  return missing_words(scene, "light", missing, there, true);
}

namespace {

/// Whether light \p i of \p scene is shown by a mesh that is not where \p light is.
bool is_elsewhere(const Scene& scene, std::size_t i, const Light& light) {
  const Light& own = scene.lights[i];
  return own.mesh >= 0 && own.mesh == light.mesh && own.is_area() && light.is_area() &&
         (own.centre != light.centre || own.u != light.u || own.v != light.v);
}

}  // namespace

bool lamps_differ(const Scene& scene, const std::vector<Light>& lights) {
  for (std::size_t i = 0; i < std::min(lights.size(), scene.lights.size()); ++i)
    if (is_elsewhere(scene, i, lights[i])) return true;
  return false;
}

void move_lamps(Scene& scene, const std::vector<Light>& lights) {
  for (std::size_t i = 0; i < std::min(lights.size(), scene.lights.size()); ++i) {
    if (!is_elsewhere(scene, i, lights[i])) continue;
    Light moved = lights[i];
    moved.radiance = scene.lights[i].radiance;
    set_light(scene, i, moved);
  }
}

}  // namespace polyhull
