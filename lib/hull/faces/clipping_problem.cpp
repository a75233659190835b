// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/clipping_problem.h"

#include <algorithm>
#include <cmath>

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

Vec3 real(const IntVec& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

}  // namespace

bool build_scene(Scene& scene, std::span<const Cone* const> cones,
                 const std::array<double, 6>& box) {
  const std::uint32_t n = static_cast<std::uint32_t>(cones.size());
  scene.cones.assign(cones.begin(), cones.end());
  scene.first_face.assign(1, 0);
  for (const Cone* cone : cones)
    scene.first_face.push_back(scene.first_face.back() + static_cast<std::uint32_t>(cone->size()));
  scene.box = box;

  WorkingVolume volume(box);
  for (const Cone* cone : cones)
    if (!cone->complement) cut_by_rectangle(volume, *cone);
  if (volume.empty()) return false;
  scene.low = Vec3(1e300), scene.high = Vec3(-1e300);
  volume.visit_corners([&](const Vec3& p) {
    scene.low = glm::min(scene.low, p);
    scene.high = glm::max(scene.high, p);
  });
  for (int axis = 0; axis < 3; ++axis) {
    const double slack = 1e-6 * (scene.high[axis] - scene.low[axis]);
    scene.box_active[2 * axis] = scene.low[axis] <= box[2 * axis] + slack;
    scene.box_active[2 * axis + 1] = scene.high[axis] >= box[2 * axis + 1] - slack;
  }

  PlaneSet& set = scene.set;
  set.planes.clear(), set.group.clear(), set.perturbation.clear();
  for (std::uint32_t i = 0; i < n; ++i) {
    const Cone& cone = *cones[i];
    set.planes.insert(set.planes.end(), cone.planes.begin(), cone.planes.end());
    set.group.insert(set.group.end(), cone.size(), static_cast<std::int32_t>(i));
    const Int128 along = static_cast<Int128>(cone.axis[0]) * cone.centre[0] +
                         static_cast<Int128>(cone.axis[1]) * cone.centre[1] +
                         static_cast<Int128>(cone.axis[2]) * cone.centre[2];
    set.perturbation.push_back({-cone.axis[0], -cone.axis[1], -cone.axis[2], along});
  }
  for (int k = 0; k < 6; ++k) {
    Plane p;
    const Int128 sign = k % 2 == 0 ? 1 : -1;
    (k / 2 == 0 ? p.a : k / 2 == 1 ? p.b : p.c) = sign;
    p.o = -sign * static_cast<Int128>(box[k]);
    set.planes.push_back(p);
    set.group.push_back(static_cast<std::int32_t>(n) + k);
    set.perturbation.push_back({0, 0, 0, -1});
  }
  set.planes.push_back({0, 0, 0, 1});
  set.group.push_back(-1);

  scene.near.resize(n), scene.far.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Cone& cone = *cones[i];
    const Vec3 axis = real(cone.axis);
    double low = 1e300, high = -1e300;
    volume.visit_corners([&](const Vec3& p) {
      const double z = glm::dot(axis, p - cone.centre_real);
      low = std::min(low, z), high = std::max(high, z);
    });
    const double slack = 1e-4 * (high - low) + 1e-7 * std::abs(high);
    low = std::floor(low - slack), high = std::ceil(high + slack);
    if (low < 1e-3 * high) low = 0.0;
    scene.near[i] = low, scene.far[i] = high;
    const Plane& q = set.perturbation[i];
    set.planes.push_back({-q.a, -q.b, -q.c, -q.o - static_cast<Int128>(low)});
    set.planes.push_back({q.a, q.b, q.c, q.o + static_cast<Int128>(high)});
    set.group.insert(set.group.end(), 2, -1);
  }

  scene.reach.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 centre = cones[i]->centre_real;
    double& reach = scene.reach[i];
    reach = scene.far[i] / glm::length(real(cones[i]->axis));
    for (const Cone* other : cones)
      reach = std::max(reach, glm::length(other->centre_real - centre));
    for (int k = 0; k < 6; ++k)
      if (scene.box_active[k]) reach = std::max(reach, std::abs(box[k] - centre[k / 2]));
  }

  scene.box_order.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) scene.box_order[i] = i;
  scene.order.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    auto& order = scene.order[i];
    order.clear();
    for (std::uint32_t k = 0; k < n; ++k)
      if (k != i) order.push_back(k);
    // The view most at right angles cuts a face shortest along its rays.
    const Vec3 middle = 0.5 * (scene.low + scene.high);
    const Vec3 own = glm::normalize(middle - cones[i]->centre_real + Vec3(1e-30));
    const auto alignment = [&](std::uint32_t k) {
      return std::abs(glm::dot(own, glm::normalize(middle - cones[k]->centre_real + Vec3(1e-30))));
    };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return alignment(a) < alignment(b); });
  }
  return true;
}

}  // namespace polyhull::hull
