// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A grid of nodes in a box, and functions on it, positive inside the surface. Lengths here and in
/// all that works on grids are in cells of the refiner's middle grid (frame.h).
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/vector.h"

namespace polyhull::refine {

/// Where the nodes are: node (x, y, z) at low + cell * (x, y, z), x fastest in memory.
struct Grid {
  Vec3f low{0.0f};
  float cell = 1.0f;  ///< from node to node
  int nx = 0, ny = 0, nz = 0;

  std::size_t row() const { return static_cast<std::size_t>(nx); }
  std::size_t slab() const { return row() * static_cast<std::size_t>(ny); }
  std::size_t size() const { return slab() * static_cast<std::size_t>(nz); }
  std::size_t node(int x, int y, int z) const {
    return static_cast<std::size_t>(z) * slab() + static_cast<std::size_t>(y) * row() +
           static_cast<std::size_t>(x);
  }
  Vec3f position(int x, int y, int z) const {
    return low + cell * Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
  }
};

/// Nodes that cover the box from \p low to \p high and \p margin cells around it.
inline Grid grid_over(const Vec3f& low, const Vec3f& high, float cell, int margin) {
  Grid grid;
  grid.cell = cell;
  grid.low = low - static_cast<float>(margin) * cell;
  const auto nodes = [&](float length) {
    return static_cast<int>(length / cell + 0.999f) + 2 * margin + 1;
  };
  grid.nx = (nodes(high.x - low.x) + 7) / 8 * 8;  // whole vectors
  grid.ny = nodes(high.y - low.y);
  grid.nz = nodes(high.z - low.z);
  return grid;
}

/// What functions are far outside the surface, and no less anywhere in the flow.
inline constexpr float outside = -2.0f;

/// How far outside the hull H is told apart; beyond f is `outside`.
inline constexpr float least_hull = -3.3f;

/// What functions are at most.
inline constexpr float deepest = 8.0f;

/// \p values between the nodes, linear along each axis; `outside` beyond the grid.
inline float sample(const Grid& grid, const float* values, const Vec3f& point) {
  const Vec3f at = (point - grid.low) / grid.cell;
  if (!(at.x >= 0.0f && at.y >= 0.0f && at.z >= 0.0f)) return outside;
  if (!(at.x < static_cast<float>(grid.nx - 1) && at.y < static_cast<float>(grid.ny - 1) &&
        at.z < static_cast<float>(grid.nz - 1)))
    return outside;
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
  const float a = at.x - static_cast<float>(x), b = at.y - static_cast<float>(y),
              c = at.z - static_cast<float>(z);
  const float* p = values + grid.node(x, y, z);
  const float* q = p + grid.row();
  const float* r = p + grid.slab();
  const float* s = r + grid.row();
  const float near0 = p[0] + a * (p[1] - p[0]), near1 = q[0] + a * (q[1] - q[0]);
  const float far0 = r[0] + a * (r[1] - r[0]), far1 = s[0] + a * (s[1] - s[0]);
  const float near = near0 + b * (near1 - near0), far = far0 + b * (far1 - far0);
  return near + c * (far - near);
}

}  // namespace polyhull::refine
