// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/moments.h"

namespace polyhull::refine {
namespace {

/// Below this length of the mean unit normal the surface in a box turns too far for one polygon.
constexpr float least_mean_normal = 0.8f;

}  // namespace

void Moments::add(const Moments& more) {
  area += more.area;
  sum += more.sum;
  normal += more.normal;
  for (int i = 0; i < 6; ++i) squares[i] += more.squares[i];
}

bool Moments::is_flat(float most) const {
  const float length = glm::length(normal);
  if (!(length > least_mean_normal * area)) return false;
  const Vec3f n = normal / length;
  const float square =
      n.x * n.x * squares[0] + n.y * n.y * squares[1] + n.z * n.z * squares[2] +
      2.0f * (n.x * n.y * squares[3] + n.y * n.z * squares[4] + n.z * n.x * squares[5]);
  const float off = glm::dot(n, sum) / area;
  return square / area - off * off <= most * most;
}

}  // namespace polyhull::refine
