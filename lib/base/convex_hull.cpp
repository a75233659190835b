// SPDX-License-Identifier: LGPL-2.1-or-later
// Andrew's monotone chain.
#include "base/convex_hull.h"

#include <algorithm>
#include <numeric>

namespace polyhull {

std::vector<std::uint32_t> convex_hull(std::span<const Vec2> points, double flat) {
  std::vector<std::uint32_t> order(points.size()), hull;
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t k) {
    const Vec2 &a = points[i], &b = points[k];
    return a.x != b.x ? a.x < b.x : a.y < b.y;
  });
  for (int side = 0; side < 2; ++side) {
    const std::size_t base = hull.size();
    for (const std::uint32_t next : order) {
      const auto is_flat = [&](const Vec2& from) {
        return !(cross(points[hull.back()] - from, points[next] - from) > flat);
      };
      while (hull.size() >= base + 2 && is_flat(points[hull[hull.size() - 2]])) hull.pop_back();
      hull.push_back(next);
    }
    if (!hull.empty()) hull.pop_back();  // the first of the other side
    std::reverse(order.begin(), order.end());
  }
  return hull;
}

}  // namespace polyhull
