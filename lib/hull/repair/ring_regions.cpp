// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/repair/ring_regions.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace polyhull::hull {
namespace {

/// Of a grid over a ring's box: long thin rings need not be found out about.
constexpr double most_points = 65536.0;

double signed_area(std::span<const Vec2f> ring) {
  double area = 0.0;
  if (ring.empty()) return area;
  Vec2 last(ring.back());
  for (const Vec2f& point : ring) {
    const Vec2 next(point);
    area += next.x * last.y - last.x * next.y;
    last = next;
  }
  return 0.5 * area;
}

/// Appends where the line at \p y crosses \p ring.
void cross_row(std::span<const Vec2f> ring, double y, std::vector<double>& crossings) {
  if (ring.empty()) return;
  Vec2 last(ring.back());
  for (const Vec2f& point : ring) {
    const Vec2 next(point);
    if ((last.y <= y) != (next.y <= y))
      crossings.push_back(last.x + (y - last.y) * (next.x - last.x) / (next.y - last.y));
    last = next;
  }
}

bool odd_left_of(const std::vector<double>& crossings, double x) {
  return std::count_if(crossings.begin(), crossings.end(), [x](double c) { return c < x; }) % 2 !=
         0;
}

}  // namespace

std::vector<RingRegion> regions_of(const Rings& rings) {
  std::vector<RingRegion> regions(rings.size());
  for (std::size_t r = 0; r < rings.size(); ++r) regions[r].area = signed_area(rings.ring(r));
  std::vector<double> crossings;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    if (rings.ring(r).empty()) continue;
    const Vec2 p(rings.ring(r).front());
    for (std::size_t around = 0; around < rings.size(); ++around) {
      if (std::abs(regions[around].area) <= std::abs(regions[r].area)) continue;
      crossings.clear();
      cross_row(rings.ring(around), p.y, crossings);
      if (!odd_left_of(crossings, p.x)) continue;
      std::int32_t& parent = regions[r].parent;
      if (parent < 0 ||
          std::abs(regions[around].area) < std::abs(regions[static_cast<std::size_t>(parent)].area))
        parent = static_cast<std::int32_t>(around);
    }
  }
  return regions;
}

std::vector<Vec2> points_inside(const Rings& rings, std::size_t ring, double area, int count) {
  Vec2 low(rings.ring(ring).front()), high = low;
  for (const Vec2f& p : rings.ring(ring))
    low = glm::min(low, Vec2(p)), high = glm::max(high, Vec2(p));
  std::vector<Vec2> points;
  std::vector<double> own, all;
  const double finest =
      std::max(0.125, std::sqrt((high.x - low.x) * (high.y - low.y) / most_points));
  for (double step = std::max({1.0, finest, std::sqrt(std::abs(area) / count)}); step >= finest;
       step *= 0.5) {
    points.clear();
    for (double y = low.y + 0.5 * step; y < high.y; y += step) {
      own.clear(), all.clear();
      cross_row(rings.ring(ring), y, own);
      for (std::size_t r = 0; r < rings.size(); ++r) cross_row(rings.ring(r), y, all);
      for (double x = low.x + 0.5 * step; x < high.x; x += step)
        if (odd_left_of(own, x) && odd_left_of(all, x) == (area > 0.0)) points.emplace_back(x, y);
    }
    if (points.size() * 8 > static_cast<std::size_t>(count)) break;
  }
  return points;
}

}  // namespace polyhull::hull
