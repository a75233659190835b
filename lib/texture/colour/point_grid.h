// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Points sorted into cubes, to find those near a place.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// Finds points near a place. The points must stay while it is in use.
class PointGrid {
 public:
  /// \p side of a cube, above 0; larger where the points' box would have too many of them.
  PointGrid(std::span<const Vec3f> points, float side) : points_(points), side_(side) {
    if (points.empty()) return;
    Vec3f high = low_ = points.front();
    for (const Vec3f& p : points) {
      low_ = glm::min(low_, p);
      high = glm::max(high, p);
    }
    constexpr double most = 1 << 21;
    for (;; side_ *= 2.0f) {
      const Vec3 count = Vec3((high - low_) / side_) + 1.0;
      if (count.x * count.y * count.z > most) continue;
      for (int i = 0; i < 3; ++i) size_[i] = static_cast<int>(count[i]);
      break;
    }
    ends_.assign(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2] + 1, 0);
    for (const Vec3f& p : points) ++ends_[cube(p) + 1];
    for (std::size_t i = 1; i < ends_.size(); ++i) ends_[i] += ends_[i - 1];
    std::vector<std::uint32_t> next(ends_.begin(), ends_.end() - 1);
    sorted_.resize(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) sorted_[next[cube(points[i])]++] = i;
  }

  /// Calls visit(i, squared distance) for each point i nearer than \p radius, always in the same order.
  template <class Visit>
  void near(const Vec3f& place, float radius, Visit&& visit) const {
    if (points_.empty()) return;
    std::array<int, 3> first{}, last{};
    for (int i = 0; i < 3; ++i) {
      first[i] = at(place[i] - radius, i);
      last[i] = at(place[i] + radius, i);
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = (static_cast<std::size_t>(z) * size_[1] + y) * size_[0];
        for (std::uint32_t k = ends_[row + first[0]]; k < ends_[row + last[0] + 1]; ++k) {
          const Vec3f way = points_[sorted_[k]] - place;
          const float square = glm::dot(way, way);
          if (square < radius * radius) visit(sorted_[k], square);
        }
      }
  }

 private:
  int at(float value, int axis) const {
    const float cubes = (value - low_[axis]) / side_;
    return static_cast<int>(std::clamp(cubes, 0.0f, static_cast<float>(size_[axis] - 1)));
  }
  std::size_t cube(const Vec3f& p) const {
    return (static_cast<std::size_t>(at(p.z, 2)) * size_[1] + at(p.y, 1)) * size_[0] + at(p.x, 0);
  }

  std::span<const Vec3f> points_;
  float side_;
  Vec3f low_{0.0f};
  std::array<int, 3> size_{};
  std::vector<std::uint32_t> ends_, sorted_;
};

}  // namespace polyhull
