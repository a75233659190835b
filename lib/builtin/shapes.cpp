// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/shapes.h"

#include <cmath>
#include <numbers>

namespace polyhull {
SceneMesh parallelogram(const std::string& name, int material, const Vec3f& corner, const Vec3f& a,
                        const Vec3f& b, const Vec2f& repeat) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.material = material;
  mesh.positions = {corner, corner + a, corner + a + b, corner + b};
  mesh.normals.assign(4, glm::normalize(glm::cross(a, b)));
  mesh.texture_coordinates = {{0, repeat.y}, repeat, {repeat.x, 0}, {0, 0}};
  mesh.triangles = {0, 1, 2, 0, 2, 3};
  return mesh;
}

SceneMesh box(const std::string& name, int material, const Vec3f& low, const Vec3f& high) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.material = material;
  const Vec3f size = high - low;
  const Vec3f x(size.x, 0, 0), y(0, size.y, 0), z(0, 0, size.z);
  append(mesh, parallelogram(name, material, low, z, y, {size.z, size.y}));
  append(mesh, parallelogram(name, material, low + x + z, -z, y, {size.z, size.y}));
  append(mesh, parallelogram(name, material, low, x, z, {size.x, size.z}));
  append(mesh, parallelogram(name, material, low + y + z, x, -z, {size.x, size.z}));
  append(mesh, parallelogram(name, material, low + x, -x, y, {size.x, size.y}));
  append(mesh, parallelogram(name, material, low + z, x, y, {size.x, size.y}));
  return mesh;
}

SceneMesh lathe(const std::string& name, int material, const Vec3f& foot,
                std::span<const Vec2f> profile, int segments) {
  SceneMesh mesh;
  mesh.name = name;
  mesh.material = material;
  float length = 0.0f;
  std::uint32_t previous_row = 0;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    // The normal of the profile: across the step before and the step after, unless there is a
    // crease.
    Vec2f along(0.0f);
    if (i > 0 && profile[i] != profile[i - 1]) along += glm::normalize(profile[i] - profile[i - 1]);
    if (i + 1 < profile.size() && profile[i + 1] != profile[i])
      along += glm::normalize(profile[i + 1] - profile[i]);
    if (i > 0) length += glm::length(profile[i] - profile[i - 1]);
    Vec2f outward(along.y, -along.x);
    outward = outward == Vec2f(0.0f) ? Vec2f(1.0f, 0.0f) : glm::normalize(outward);
    const auto row = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k <= segments; ++k) {
      const float turn = static_cast<float>(k) / static_cast<float>(segments);
      const float c = std::cos(2.0f * std::numbers::pi_v<float> * turn),
                  s = -std::sin(2.0f * std::numbers::pi_v<float> * turn);
      mesh.positions.push_back(foot + Vec3f(profile[i].x * c, profile[i].y, profile[i].x * s));
      mesh.normals.emplace_back(outward.x * c, outward.y, outward.x * s);
      mesh.texture_coordinates.emplace_back(turn, -length);
    }
    // The seam closes exactly.
    mesh.positions.back() = mesh.positions[row];
    mesh.normals.back() = mesh.normals[row];
    if (i > 0 && profile[i] != profile[i - 1]) {
      for (std::uint32_t k = 0; k < static_cast<std::uint32_t>(segments); ++k) {
        const std::uint32_t a = previous_row + k, b = row + k;
        if (profile[i - 1].x > 0.0f) mesh.triangles.insert(mesh.triangles.end(), {a, a + 1, b + 1});
        if (profile[i].x > 0.0f) mesh.triangles.insert(mesh.triangles.end(), {a, b + 1, b});
      }
    }
    previous_row = row;
  }
  return mesh;
}

SceneMesh sphere(const std::string& name, int material, const Vec3f& centre, float radius,
                 int segments) {
  std::vector<Vec2f> profile;
  const int rows = segments / 2;
  for (int i = 0; i <= rows; ++i) {
    const float angle =
        std::numbers::pi_v<float> * (static_cast<float>(i) / static_cast<float>(rows) - 0.5f);
    const bool pole = i == 0 || i == rows;
    profile.emplace_back(pole ? 0.0f : radius * std::cos(angle), radius * std::sin(angle));
  }
  SceneMesh mesh = lathe(name, material, centre, profile, segments);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    mesh.normals[i] = glm::normalize(mesh.positions[i] - centre);
  return mesh;
}

void append(SceneMesh& mesh, const SceneMesh& part) {
  if (mesh.positions.empty()) {
    const std::string name = mesh.name.empty() ? part.name : mesh.name;
    mesh = part;
    mesh.name = name;
    return;
  }
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
  mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
  mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), part.texture_coordinates.begin(),
                                  part.texture_coordinates.end());
  for (const std::uint32_t index : part.triangles) mesh.triangles.push_back(base + index);
}

SceneMesh picture_frame(const std::string& name, int material, const Vec3f& low,
                        const Vec3f& across, const Vec3f& up, const Vec3f& depth, float border) {
  const Vec3f x = border * glm::normalize(across), y = border * glm::normalize(up);
  SceneMesh frame;
  const auto bar = [&](const Vec3f& a, const Vec3f& b) {
    append(frame, box(name, material, glm::min(a, b + depth), glm::max(a, b + depth)));
  };
  bar(low - x - y, low + across + x);
  bar(low + up - x, low + across + up + x + y);
  bar(low - x, low + up);
  bar(low + across, low + across + up + x);
  return frame;
}

}  // namespace polyhull
