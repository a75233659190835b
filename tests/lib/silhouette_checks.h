// SPDX-License-Identifier: LGPL-2.1-or-later
// Shapes to draw and exact checks of rings, shared by the silhouette stage's tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "silhouette/matte.h"
#include "silhouette/rings.h"
#include "silhouette/trace.h"

namespace polyhull::test {

/// A matte from a function of the pixel.
inline Matte draw(int width, int height, const std::function<int(int, int)>& level) {
  std::vector<std::uint8_t> plane(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      plane[static_cast<std::size_t>(y) * width + x] = static_cast<std::uint8_t>(level(x, y));
  Matte matte;
  load_matte(plane.data(), width, 1, width, height, matte);
  return matte;
}

/// Alpha of a pixel of which `inside` (a function of real x, y) covers a part: 8 x 8 samples.
inline int coverage(int x, int y, const std::function<bool(double, double)>& inside) {
  int count = 0;
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i)
      count += inside(x + (i + 0.5) / 8.0 - 0.5, y + (j + 0.5) / 8.0 - 0.5);
  return (count * 255 + 32) / 64;
}

/// A disk by signed distance: coverage of a straight edge, exact enough for radii of many pixels.
inline Matte soft_disk(int size, double cx, double cy, double radius) {
  return draw(size, size, [&](int x, int y) {
    const double d = radius - std::hypot(x - cx, y - cy);
    if (d > 2.0) return 255;
    if (d < -2.0) return 0;
    int count = 0;
    for (int j = 0; j < 32; ++j)
      for (int i = 0; i < 32; ++i)
        count += std::hypot(x + (i + 0.5) / 32 - 0.5 - cx, y + (j + 0.5) / 32 - 0.5 - cy) < radius;
    return static_cast<int>(std::lround(count * 255.0 / 1024.0));
  });
}

struct Segment {
  Vec2f a, b;
  std::size_t ring, index, count;
};

inline std::vector<Segment> segments_of(const Rings& rings) {
  std::vector<Segment> out;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const auto ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i)
      out.push_back({ring[i], ring[(i + 1) % ring.size()], r, i, ring.size()});
  }
  return out;
}

/// Twice the signed area of a triangle; exact for coordinates that are multiples of 1/512 below
/// 2^15.
inline std::int64_t turn(Vec2f a, Vec2f b, Vec2f c) {
  const auto u = [](float v) { return static_cast<std::int64_t>(std::llround(v * 512.0)); };
  return (u(b.x) - u(a.x)) * (u(c.y) - u(a.y)) - (u(b.y) - u(a.y)) * (u(c.x) - u(a.x));
}

inline bool between(Vec2f a, Vec2f b, Vec2f p) {
  return std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
         p.y <= std::max(a.y, b.y);
}

inline bool segments_meet(const Segment& s, const Segment& t) {
  const auto sign = [](std::int64_t v) { return (v > 0) - (v < 0); };
  const int a = sign(turn(s.a, s.b, t.a)), b = sign(turn(s.a, s.b, t.b));
  const int c = sign(turn(t.a, t.b, s.a)), d = sign(turn(t.a, t.b, s.b));
  if (s.ring == t.ring) {
    const bool next = (s.index + 1) % s.count == t.index, last = (t.index + 1) % t.count == s.index;
    if (next && last) return true;
    if (next || last) {
      // Neighbours share a corner; they must not fold back onto each other.
      const double dot = (static_cast<double>(s.b.x) - s.a.x) * (t.b.x - t.a.x) +
                         (static_cast<double>(s.b.y) - s.a.y) * (t.b.y - t.a.y);
      return a == 0 && b == 0 && dot < 0.0;
    }
  }
  if (a == 0 && between(s.a, s.b, t.a)) return true;
  if (b == 0 && between(s.a, s.b, t.b)) return true;
  if (c == 0 && between(t.a, t.b, s.a)) return true;
  if (d == 0 && between(t.a, t.b, s.b)) return true;
  return a * b < 0 && c * d < 0;
}

/// Every ring has at least three corners, none twice in a row, and no two edges meet: by testing
/// each pair whose boxes overlap, sorted by y.
inline ::testing::AssertionResult simple_and_disjoint(const Rings& rings) {
  std::vector<Segment> all = segments_of(rings);
  for (std::size_t r = 0; r < rings.size(); ++r)
    if (rings.ring(r).size() < 3)
      return ::testing::AssertionFailure()
             << "ring " << r << " has " << rings.ring(r).size() << " vertices";
  for (const Segment& s : all)
    if (s.a == s.b)
      return ::testing::AssertionFailure() << "edge without length in ring " << s.ring;
  std::sort(all.begin(), all.end(), [](const Segment& s, const Segment& t) {
    return std::min(s.a.y, s.b.y) < std::min(t.a.y, t.b.y);
  });
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      if (std::min(all[j].a.y, all[j].b.y) > std::max(all[i].a.y, all[i].b.y)) break;
      if (std::min(all[j].a.x, all[j].b.x) > std::max(all[i].a.x, all[i].b.x) ||
          std::max(all[j].a.x, all[j].b.x) < std::min(all[i].a.x, all[i].b.x))
        continue;
      if (segments_meet(all[i], all[j]))
        return ::testing::AssertionFailure()
               << "edge " << all[i].index << " of ring " << all[i].ring << " meets edge "
               << all[j].index << " of ring " << all[j].ring << " near (" << all[i].a.x << ", "
               << all[i].a.y << ")";
    }
  return ::testing::AssertionSuccess();
}

inline bool contains(std::span<const Vec2f> ring, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2f a = ring[j], b = ring[i];
    if ((a.y <= y) == (b.y <= y)) continue;
    if (a.x + (y - a.y) / (static_cast<double>(b.y) - a.y) * (static_cast<double>(b.x) - a.x) > x)
      inside = !inside;
  }
  return inside;
}

/// Outer rings lie inside an even number of others, holes inside an odd number.
inline ::testing::AssertionResult well_nested(const Rings& rings) {
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const Vec2f p = rings.ring(i)[0];
    int around = 0;
    for (std::size_t j = 0; j < rings.size(); ++j)
      around += i != j && contains(rings.ring(j), p.x, p.y);
    const bool hole = ring_area(rings.ring(i)) < 0.0;
    if ((around % 2 == 1) != hole)
      return ::testing::AssertionFailure() << "ring " << i << (hole ? " (a hole)" : " (outer)")
                                           << " lies inside " << around << " others";
  }
  return ::testing::AssertionSuccess();
}

inline double total_area(const Rings& rings) {
  double area = 0.0;
  for (std::size_t i = 0; i < rings.size(); ++i) area += ring_area(rings.ring(i));
  return area;
}

inline double distance_to_segment(double px, double py, Vec2f a, Vec2f b) {
  const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
  const double length2 = dx * dx + dy * dy;
  double t = length2 > 0.0 ? ((px - a.x) * dx + (py - a.y) * dy) / length2 : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  return std::hypot(px - a.x - t * dx, py - a.y - t * dy);
}

/// The largest distance of points along `from` (at most `step` apart) to the rings `to`.
inline double one_sided_distance(const Rings& from, const Rings& to, double step) {
  double most = 0.0;
  const std::vector<Segment> targets = segments_of(to);
  for (const Segment& s : segments_of(from)) {
    const double length = std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
    const int n = std::max(1, static_cast<int>(std::ceil(length / step)));
    for (int i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) / n;
      const double px = s.a.x + t * (s.b.x - s.a.x), py = s.a.y + t * (s.b.y - s.a.y);
      double best = 1e30;
      for (const Segment& other : targets) {
        if (std::min(other.a.x, other.b.x) - px > best ||
            px - std::max(other.a.x, other.b.x) > best)
          continue;
        best = std::min(best, distance_to_segment(px, py, other.a, other.b));
      }
      most = std::max(most, best);
    }
  }
  return most;
}

}  // namespace polyhull::test
