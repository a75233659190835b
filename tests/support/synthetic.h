// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Meshes, cameras and pictures made by formula, for tests of texturing and rendering.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "base/picture.h"
#include "hull/hull.h"
#include "mesh/mesh.h"
#include "rig/camera.h"
#include "scene/scene.h"

namespace polyhull::synthetic {

/// A camera at \p position that looks at \p target, y up, with horizontal field of view in degrees.
inline Camera look_at(const Vec3& position, const Vec3& target, int width, int height,
                      double degrees) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  const Vec3 forward = glm::normalize(target - position);
  const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0.0, 1.0, 0.0)));
  const Vec3 down = glm::cross(forward, right);
  camera.R = glm::transpose(Mat3(right, down, forward));
  camera.t = -(camera.R * position);
  const double f = 0.5 * width / std::tan(0.5 * degrees * std::numbers::pi / 180.0);
  camera.K = from_rows({f, 0, 0.5 * (width - 1), 0, f, 0.5 * (height - 1), 0, 0, 1});
  return camera;
}

/// \p count cameras on a circle of \p radius at \p height around the y axis, looking at \p target.
inline std::vector<Camera> ring(int count, double radius, double height, const Vec3& target,
                                int width = 640, int rows = 480, double degrees = 60.0) {
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    cameras.push_back(look_at({radius * std::sin(angle), height, radius * std::cos(angle)}, target,
                              width, rows, degrees));
    cameras.back().name = "cam" + std::to_string(i);
  }
  return cameras;
}

inline void append(Hull& hull, const std::vector<Vec3f>& vertices,
                   const std::vector<std::uint32_t>& triangles) {
  const auto base = static_cast<std::uint32_t>(hull.vertices.size());
  hull.vertices.insert(hull.vertices.end(), vertices.begin(), vertices.end());
  for (const std::uint32_t index : triangles) hull.triangles.push_back(base + index);
}

/// A closed ellipsoid of 2 * \p stacks * (\p stacks - 1) * 2 triangles, outside counter-clockwise.
inline void add_ellipsoid(Hull& hull, const Vec3f& centre, const Vec3f& radii, int stacks) {
  std::vector<Vec3f> vertices{centre + Vec3f(0, radii.y, 0)};
  std::vector<std::uint32_t> triangles;
  const int slices = 2 * stacks;
  for (int i = 1; i < stacks; ++i) {
    const double theta = std::numbers::pi * i / stacks;
    for (int j = 0; j < slices; ++j) {
      const double phi = 2.0 * std::numbers::pi * j / slices;
      vertices.push_back(centre + radii * Vec3f(std::sin(theta) * std::sin(phi), std::cos(theta),
                                                std::sin(theta) * std::cos(phi)));
    }
  }
  vertices.push_back(centre - Vec3f(0, radii.y, 0));
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(1 + (i - 1) * slices + j % slices);
  };
  const auto last = static_cast<std::uint32_t>(vertices.size() - 1);
  for (int j = 0; j < slices; ++j) {
    triangles.insert(triangles.end(), {0, at(1, j), at(1, j + 1)});
    triangles.insert(triangles.end(), {last, at(stacks - 1, j + 1), at(stacks - 1, j)});
    for (int i = 1; i + 1 < stacks; ++i) {
      triangles.insert(triangles.end(), {at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.insert(triangles.end(), {at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  append(hull, vertices, triangles);
}

/// A closed box, outside counter-clockwise.
inline void add_box(Hull& hull, const Vec3f& low, const Vec3f& high) {
  std::vector<Vec3f> vertices;
  for (int i = 0; i < 8; ++i) {
    vertices.emplace_back(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
  }
  append(hull, vertices, {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                          2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6});
}

/// Something with limbs: a body, a head and two arms held in front of it. \p stacks sets how fine.
inline Hull figure(int stacks = 16) {
  Hull hull;
  add_ellipsoid(hull, {0.0f, 0.9f, 0.0f}, {0.28f, 0.9f, 0.2f}, stacks);
  add_ellipsoid(hull, {0.0f, 1.95f, 0.0f}, {0.14f, 0.17f, 0.15f}, stacks);
  add_ellipsoid(hull, {-0.28f, 1.2f, 0.32f}, {0.08f, 0.08f, 0.35f}, stacks);
  add_ellipsoid(hull, {0.28f, 1.2f, 0.32f}, {0.08f, 0.08f, 0.35f}, stacks);
  return hull;
}

/// The world colour (0..1) that figures are painted with: smooth, different everywhere.
inline Vec3f paint(const Vec3& p) {
  return {0.5f + 0.4f * static_cast<float>(std::sin(5.0 * p.x + 2.0 * p.z)),
          0.5f + 0.4f * static_cast<float>(std::sin(4.0 * p.y)),
          0.5f + 0.4f * static_cast<float>(std::cos(5.0 * p.z - 3.0 * p.x))};
}

/// A picture of \p hull as \p camera sees it, painted by paint(), on green; alpha is the coverage
/// of the hull's own pixels (hard).
Picture photograph(const Hull& hull, const Camera& camera);

/// A mesh of \p hull with photographs by \p cameras as views; the pictures keep the pixels alive.
struct Photographed {
  Mesh mesh;
  std::vector<Picture> pictures;
};
Photographed photographed(const Hull& hull, const std::vector<Camera>& cameras);

/// A small room: floor (a mirror of its own colour), back wall, a pillar, one area light above.
Scene small_room(bool polished);

}  // namespace polyhull::synthetic
