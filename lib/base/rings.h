// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Closed polygons of one silhouette, stored flat.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// The silhouette as a set of simple, disjoint rings in full-frame pixels. Outer rings run
/// counter-clockwise and holes clockwise as seen on screen (y down), so the silhouette is on the
/// left of every edge as seen on screen. The region is also the even-odd union of the rings. The
/// last vertex of a ring connects to its first; the first is not repeated.
struct Rings {
  std::vector<Vec2f> points;        ///< all rings' vertices, one ring after the other
  std::vector<std::uint32_t> ends;  ///< ends[i]: index one past the last vertex of ring i

  std::size_t size() const { return ends.size(); }
  bool empty() const { return ends.empty(); }
  std::span<const Vec2f> ring(std::size_t i) const {
    const std::size_t begin = i == 0 ? 0 : ends[i - 1];
    return {points.data() + begin, ends[i] - begin};
  }
  void clear() {
    points.clear();
    ends.clear();
  }
  bool operator==(const Rings&) const = default;
};

/// Whether \p p lies inside of a closed polygon, by the even-odd rule.
inline bool is_inside(std::span<const Vec2f> ring, const Vec2& p) {
  bool in = false;
  for (std::size_t i = 0, before = ring.size() - 1; i < ring.size(); before = i++) {
    const Vec2 a(ring[before]), b(ring[i]);
    if ((a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)) in = !in;
  }
  return in;
}

/// Whether \p p lies in the region of \p rings.
inline bool is_inside(const Rings& rings, const Vec2& p) {
  bool in = false;
  for (std::size_t r = 0; r < rings.size(); ++r) in ^= is_inside(rings.ring(r), p);
  return in;
}

}  // namespace polyhull
