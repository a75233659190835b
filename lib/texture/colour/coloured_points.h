// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Points of a surface with their colours, and which of them is near.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vector.h"
#include "texture/colour/point_grid.h"

namespace polyhull {

/// Points of a surface with unit normals and colours (sRGB codes, 0..255), in arrays of one size.
struct ColouredPoints {
  std::vector<Vec3f> positions, normals, colours;
  void add(const Vec3f& position, const Vec3f& normal, const Vec3f& colour) {
    positions.push_back(position);
    normals.push_back(normal);
    colours.push_back(colour);
  }
  void resize(std::size_t count) {
    for (auto* list : {&positions, &normals, &colours}) list->resize(count);
  }
  /// Point \p to becomes what \p from is.
  void move(std::size_t from, std::size_t to) {
    for (auto* list : {&positions, &normals, &colours}) (*list)[to] = (*list)[from];
  }
  std::size_t size() const { return positions.size(); }
};

/// Whether two parts of a surface face the same way, roughly.
inline bool alike(const Vec3f& normal, const Vec3f& other) {
  return glm::dot(normal, other) > 0.3f;
}

inline constexpr std::uint32_t no_point = ~0u;

/// Of the points in \p grid, which have \p normals, the nearest within \p radius of \p place that
/// faces as \p normal does: the cosine of the angle between is above \p least. no_point: none.
inline std::uint32_t nearest_point(const PointGrid& grid, const std::vector<Vec3f>& normals,
                                   const Vec3f& place, const Vec3f& normal, float radius,
                                   float least) {
  std::uint32_t found = no_point;
  float best = radius * radius;
  grid.near(place, radius, [&](std::uint32_t i, float square) {
    if (!(square < best) || !(glm::dot(normals[i], normal) > least)) return;
    best = square;
    found = i;
  });
  return found;
}

}  // namespace polyhull
