// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/clipping_problem.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "hull/working_volume.h"

namespace polyhull::hull {
namespace {

/// The four planes through the rectangle around a silhouette, a little outside of it.
void cut_by_rectangle(WorkingVolume& volume, const Cone& cone) {
  Vec2 low(1e300), high(-1e300);
  for (const Vec2& p : cone.pixels) low = glm::min(low, p), high = glm::max(high, p);
  const Vec2 margin = Vec2(0.01) + 1e-9 * (glm::abs(low) + glm::abs(high));
  low -= margin, high += margin;
  const Vec2 corners[4] = {low, {high.x, low.y}, high, {low.x, high.y}};
  Vec3 ray[4];
  Vec3 middle(0.0);
  for (int k = 0; k < 4; ++k) {
    ray[k] = glm::normalize(cone.camera.to_ray * Vec3(corners[k], 1.0));
    middle += ray[k];
  }
  for (int k = 0; k < 4; ++k) {
    Vec3 n = glm::normalize(glm::cross(ray[k], ray[(k + 1) % 4]));
    if (glm::dot(n, middle) < 0) n = -n;
    volume.cut(n, -glm::dot(n, cone.centre_real) + 1e-9 * glm::length(cone.centre_real));
  }
  volume.cut(cone.camera.forward, -glm::dot(cone.camera.forward, cone.centre_real) +
                                      1e-9 * glm::length(cone.centre_real));
}

/// The box around \p volume, and which faces of the bounds it touches.
void enclose(ClippingProblem& problem, const WorkingVolume& volume) {
  problem.low = Vec3(1e300), problem.high = Vec3(-1e300);
  volume.visit_corners([&](const Vec3& p) {
    problem.low = glm::min(problem.low, p);
    problem.high = glm::max(problem.high, p);
  });
  for (int axis = 0; axis < 3; ++axis) {
    const double slack = 1e-6 * (problem.high[axis] - problem.low[axis]);
    problem.box_active[2 * axis] = problem.low[axis] <= problem.box[2 * axis] + slack;
    problem.box_active[2 * axis + 1] = problem.high[axis] >= problem.box[2 * axis + 1] - slack;
  }
}

/// The planes of the cones' faces and of the box, and that at infinity.
void number_planes(PlaneSet& set, const ClippingProblem& problem) {
  set.planes.clear(), set.group.clear(), set.perturbation.clear();
  std::int32_t group = 0;
  for (const Cone* cone : problem.cones) {
    set.planes.insert(set.planes.end(), cone->planes.begin(), cone->planes.end());
    set.group.insert(set.group.end(), cone->size(), group++);
    const Int128 along = static_cast<Int128>(cone->axis[0]) * cone->centre[0] +
                         static_cast<Int128>(cone->axis[1]) * cone->centre[1] +
                         static_cast<Int128>(cone->axis[2]) * cone->centre[2];
    set.perturbation.push_back({-cone->axis[0], -cone->axis[1], -cone->axis[2], along});
  }
  for (int k = 0; k < 6; ++k) {
    Plane p;
    const Int128 sign = k % 2 == 0 ? 1 : -1;
    (k / 2 == 0 ? p.a : k / 2 == 1 ? p.b : p.c) = sign;
    p.o = -sign * static_cast<Int128>(problem.box[k]);
    set.planes.push_back(p);
    set.group.push_back(group++);
    set.perturbation.push_back({0, 0, 0, -1});
  }
  set.planes.push_back({0, 0, 0, 1});
  set.group.push_back(-1);
}

/// Each cone's near and far plane around \p volume.
void bound_cones(ClippingProblem& problem, const WorkingVolume& volume) {
  problem.near.clear(), problem.far.clear();
  PlaneSet& set = problem.set;
  for (std::size_t i = 0; i < problem.cones.size(); ++i) {
    const Cone& cone = *problem.cones[i];
    const Vec3 axis = real(cone.axis);
    double low = 1e300, high = -1e300;
    volume.visit_corners([&](const Vec3& p) {
      const double z = glm::dot(axis, p - cone.centre_real);
      low = std::min(low, z), high = std::max(high, z);
    });
    const double slack = 1e-4 * (high - low) + 1e-7 * std::abs(high);
    low = std::floor(low - slack), high = std::ceil(high + slack);
    if (low < 1e-3 * high) low = 0.0;
    problem.near.push_back(low), problem.far.push_back(high);
    const Plane& q = set.perturbation[i];
    set.planes.push_back({-q.a, -q.b, -q.c, -q.o - static_cast<Int128>(low)});
    set.planes.push_back({q.a, q.b, q.c, q.o + static_cast<Int128>(high)});
    set.group.insert(set.group.end(), 2, -1);
  }
}

/// How far each cone's faces reach.
void measure_reach(ClippingProblem& problem) {
  problem.reach.clear();
  for (std::size_t i = 0; i < problem.cones.size(); ++i) {
    const Vec3 centre = problem.cones[i]->centre_real;
    double reach = problem.far[i] / glm::length(real(problem.cones[i]->axis));
    for (const Cone* other : problem.cones)
      reach = std::max(reach, glm::length(other->centre_real - centre));
    for (int k = 0; k < 6; ++k)
      if (problem.box_active[k]) reach = std::max(reach, std::abs(problem.box[k] - centre[k / 2]));
    problem.reach.push_back(reach);
  }
}

/// In which order a cone's faces meet the others: the view most at right angles cuts a face
/// shortest along its rays.
void order_cones(ClippingProblem& problem) {
  const std::size_t n = problem.cones.size();
  const Vec3 middle = 0.5 * (problem.low + problem.high);
  std::vector<Vec3> towards;
  for (const Cone* cone : problem.cones)
    towards.push_back(glm::normalize(middle - cone->centre_real + Vec3(1e-30)));
  problem.box_order.resize(n);
  std::iota(problem.box_order.begin(), problem.box_order.end(), 0u);
  problem.order.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    auto& order = problem.order[i];
    order = problem.box_order;
    order.erase(order.begin() + i);
    const auto alignment = [&](std::uint32_t k) {
      return std::abs(glm::dot(towards[i], towards[k]));
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return alignment(a) < alignment(b); });
  }
}

}  // namespace

bool ClippingProblem::set_up(std::span<const Cone* const> all,
                             const std::array<double, 6>& limits) {
  cones.assign(all.begin(), all.end());
  box = limits;
  first_face.assign(1, 0);
  for (const Cone* cone : cones)
    first_face.push_back(first_face.back() + static_cast<std::uint32_t>(cone->size()));
  WorkingVolume volume(box);
  for (const Cone* cone : cones)
    if (!cone->complement) cut_by_rectangle(volume, *cone);
  if (volume.empty()) return false;
  enclose(*this, volume);
  number_planes(set, *this);
  bound_cones(*this, volume);
  measure_reach(*this);
  order_cones(*this);
  return true;
}

}  // namespace polyhull::hull
