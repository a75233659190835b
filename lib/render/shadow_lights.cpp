// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/shadow_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "render/light_samples.h"
#include "render/projection.h"
#include "scene/spot_cone.h"

namespace polyhull {
namespace {

/// A quarter of what is no change (BlendPixels::least_missing, composite.frag).
constexpr double unseen = 1e-5;
constexpr double most_given = 1e30;  // so that sums are finite

/// The most that light_exit() can be for what lies in \p box.
double most_exit(const Light& light, const Bounds& box) {
  if (!light.is_area()) return 1.0;
  const Vec3 normal(light_normal(light)), centre(light.centre);
  const std::vector<Vec3> ends = corners(box);
  if (std::all_of(ends.begin(), ends.end(),
                  [&](const Vec3& end) { return glm::dot(normal, end - centre) <= 0.0; }))
    return 0.0;
  if (!light.is_spot()) return 1.0;
  // Seen from anywhere on the light, the box lies within a ball seen from its centre.
  const Vec3 way = 0.5 * (box.min + box.max) - centre;
  const double distance = glm::length(way);
  const double ball = 0.5 * glm::distance(box.min, box.max) + glm::length(Vec3(light.u)) +
                      glm::length(Vec3(light.v));
  if (distance <= ball) return 1.0;
  const double aside = std::acos(std::clamp(glm::dot(normal, way) / distance, -1.0, 1.0));
  const double nearest = std::max(aside - std::asin(ball / distance), 0.0);
  return cone_of(light).at(static_cast<float>(std::cos(nearest)));
}

double largest(const Vec3f& colour) {
  return std::max({colour.x, colour.y, colour.z});
}

/// The most that any surface loses, per channel, where what stands in \p box blocks \p light.
double most_taken(const Light& light, const Bounds& box) {
  const double power = largest(light_power(light)), exit = most_exit(light, box);
  if (!(power > 0.0) || exit == 0.0) return 0.0;
  const Vec3 centre(light.centre);
  const double distance = glm::distance(centre, glm::clamp(centre, box.min, box.max)) -
                          glm::length(Vec3(light.u)) - glm::length(Vec3(light.v));
  if (!(distance > 0.0)) return std::numeric_limits<double>::infinity();
  return power * exit / (distance * distance);
}

}  // namespace

std::vector<ShadowLight> find_shadow_lights(std::span<const Light> lights, float exposure,
                                            const Bounds& box, bool all) {
  // The box's middle and those of its faces: a lamp may shine on one end of it alone.
  std::vector<Vec3> places(7, 0.5 * (box.min + box.max));
  for (int axis = 0; axis < 3; ++axis) {
    places[1 + 2 * axis][axis] = box.min[axis];
    places[2 + 2 * axis][axis] = box.max[axis];
  }
  struct Candidate {
    std::size_t light;
    double taken, given;
  };
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    Candidate next{i, most_taken(lights[i], box) * exposure * std::numbers::inv_pi, 0.0};
    if (next.taken > 0.0) {
      for (const Vec3& place : places) {
        const double given = light_given(lights[i], place);
        next.given = std::max(next.given, given < most_given ? given : most_given);
      }
    } else if (all) {
      next.taken = 0.0;  // and not no number
    } else {
      continue;
    }
    candidates.push_back(next);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.taken < b.taken; });
  auto seen = candidates.begin();
  double together = 0.0;
  while (seen != candidates.end() && together + seen->taken <= unseen) together += seen++->taken;
  // Idle ones stay where all are wanted.
  candidates.erase(std::find_if(candidates.begin(), seen,
                                [](const Candidate& candidate) { return candidate.taken > 0.0; }),
                   seen);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.given != b.given ? a.given > b.given : a.light < b.light;
                   });
  double sum = 0.0, effective = 0.0;
  for (const Candidate& candidate : candidates) {
    sum += candidate.given;
    effective += candidate.taken > 0.0 ? 1.0 : 0.0;
  }
  std::vector<ShadowLight> out;
  for (const auto& [light, taken, given] : candidates) {
    const double share = sum > 0.0 ? given / sum : 1.0 / std::max(effective, 1.0);
    out.push_back({light, static_cast<float>(share), taken == 0.0, false, {}, {}});
  }
  return out;
}

}  // namespace polyhull
