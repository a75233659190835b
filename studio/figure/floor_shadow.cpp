// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/floor_shadow.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

float square(const Vec3f& v) {
  return glm::dot(v, v);
}

constexpr int lines_at_once = 16;

/// A box pass of radius \p radius along one axis of a square map, several lines at a time: each
/// sum waits for the one before it in its line.
void smooth_axis(const std::vector<float>& in, std::vector<float>& out, int cells, int radius,
                 bool along_x) {
  const std::size_t step = along_x ? 1 : cells, next = along_x ? cells : 1;
  const float scale = 1.0f / static_cast<float>(2 * radius + 1);
  for (int line = 0; line < cells; line += lines_at_once) {
    const float* source = in.data() + line * next;
    float* target = out.data() + line * next;
    float sums[lines_at_once] = {};
    const auto add = [&](int i, float sign) {
      for (int k = 0; k < lines_at_once; ++k) sums[k] += sign * source[i * step + k * next];
    };
    for (int i = 0; i < radius; ++i) add(i, 1.0f);
    for (int i = 0; i < cells; ++i) {
      if (i + radius < cells) add(i + radius, 1.0f);
      if (i - radius - 1 >= 0) add(i - radius - 1, -1.0f);
      for (int k = 0; k < lines_at_once; ++k)
        target[i * step + k * next] = std::max(sums[k] * scale, 0.0f);
    }
  }
}

void blur_map(std::vector<float>& map, std::vector<float>& scratch, int cells, int radius,
              int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    smooth_axis(map, scratch, cells, radius, true);
    smooth_axis(scratch, map, cells, radius, false);
  }
}

}  // namespace

FloorShadow::FloorShadow(const SubjectFrame& frame, const std::vector<std::uint32_t>& triangles)
    : map_(cells * cells, 0.0f) {
  static_assert(cells % lines_at_once == 0);
  constexpr float per_metre = cells / (2.0f * reach);
  constexpr float small = 0.9f / per_metre, small_square = small * small;
  const auto mark = [&](const Vec3f& p) {
    // The lamps hang a little to the front left: the shadow leans to the back right. What is high
    // up is so far from the floor that its shadow dissolves.
    const float fade = 1.0f / (1.0f + 2.2f * std::max(p.y, 0.0f));
    const float x = (p.x - 0.22f * p.y + reach) * per_metre;
    const float z = (p.z - 0.30f * p.y + reach) * per_metre;
    if (!(x >= 0.0f && z >= 0.0f && x < cells && z < cells)) return;
    float& cell = map_[static_cast<std::size_t>(z) * cells + static_cast<std::size_t>(x)];
    cell = std::max(cell, fade);
  };
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Vec3f &a = frame.positions[triangles[t]], &b = frame.positions[triangles[t + 1]],
                &c = frame.positions[triangles[t + 2]];
    const float longest_square = std::max({square(a - b), square(b - c), square(c - a)});
    // Of triangles smaller than a cell one corner is enough: the neighbours mark the others.
    if (longest_square < small_square) {
      mark(a);
      continue;
    }
    const float longest = std::sqrt(longest_square);
    const int steps = std::clamp(static_cast<int>(std::ceil(longest * per_metre)), 1, 4 * cells);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const float s = static_cast<float>(i) / static_cast<float>(steps);
        const float r = static_cast<float>(j) / static_cast<float>(steps);
        mark(a + (b - a) * s + (c - a) * r);
      }
    }
  }
  // A tight part at the feet and a wide one around.
  std::vector<float> scratch(map_.size());
  blur_map(map_, scratch, cells, 1, 2);
  std::vector<float> wide = map_;
  blur_map(wide, scratch, cells, 6, 3);
  for (std::size_t i = 0; i < map_.size(); ++i)
    map_[i] = std::min(0.6f * map_[i] + 0.9f * wide[i], 1.0f);

  int first_x = cells, last_x = -1, first_z = cells, last_z = -1;
  for (int z = 0; z < cells; ++z) {
    for (int x = 0; x < cells; ++x) {
      if (map_[static_cast<std::size_t>(z) * cells + x] < 0.5f / 255.0f) continue;
      first_x = std::min(first_x, x);
      last_x = std::max(last_x, x);
      first_z = std::min(first_z, z);
      last_z = z;
    }
  }
  if (last_z < 0) return;
  // Between the cells' middles the map is interpolated.
  low_ = Vec2f(first_x - 1, first_z - 1) / per_metre - reach;
  high_ = Vec2f(last_x + 2, last_z + 2) / per_metre - reach;
}

}  // namespace polyhull
