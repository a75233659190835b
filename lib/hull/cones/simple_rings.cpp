// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/simple_rings.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {
namespace {

/// Rings whose parts come nearer than this are cleaned; clean ones keep further apart.
constexpr double nearest_pixels = 1e-6;

/// Pixels that edges of rings which are not cleaned keep apart.
double nearest(const Cone& c) {
  return nearest_pixels + 2 * c.pixel_error;
}

/// Whether an end of one edge lies so near the other that rounding could put it on either side.
bool close(const Cone& c, std::uint32_t e, std::uint32_t f) {
  const auto near = [&](const ContourGrid::Segment& s, const Vec2& p) {
    const Vec2 d = s.b - s.a, to = p - s.a;
    const double length = glm::dot(d, d), off = cross(d, to);
    const double along = glm::dot(d, to);
    const double reach = nearest(c) * std::sqrt(length);
    return std::abs(off) < reach && along > -reach && along < length + reach;
  };
  const ContourGrid::Segment &s = c.grid.segment(e), &t = c.grid.segment(f);
  return near(s, t.a) || near(s, t.b) || near(t, s.a) || near(t, s.b);
}

/// Of edges on one straight line.
bool apart_on_line(const Cone& cone, std::uint32_t e, std::uint32_t f) {
  const Vec2 a = cone.pixels[e], b = cone.pixels[cone.next[e]];
  const Vec2 c = cone.pixels[f], d = cone.pixels[cone.next[f]];
  const int k = std::abs(b.x - a.x) > std::abs(b.y - a.y) ? 0 : 1;
  return std::max(a[k], b[k]) < std::min(c[k], d[k]) || std::max(c[k], d[k]) < std::min(a[k], b[k]);
}

bool share_end(const Cone& c, std::uint32_t e, std::uint32_t f) {
  const std::uint32_t g = c.next[e], h = c.next[f];
  return c.rays[e] == c.rays[f] || c.rays[e] == c.rays[h] || c.rays[g] == c.rays[f] ||
         c.rays[g] == c.rays[h];
}

/// Whether two edges meet where they may not.
bool meet(const Cone& c, std::uint32_t e, std::uint32_t f, bool clean) {
  if (c.next[e] == f || c.next[f] == e) return false;
  if (clean && share_end(c, e, f)) return false;
  if (!clean && close(c, e, f)) return true;
  const int s0 = side_of(c, e, f), s1 = side_of(c, e, c.next[f]);
  if (s0 * s1 > 0) return false;
  const int t0 = side_of(c, f, e), t1 = side_of(c, f, c.next[e]);
  if (t0 * t1 > 0) return false;
  // Clean rings may touch where they have no vertex: a straight one was taken out.
  if (clean && (s0 * s1 == 0 || t0 * t1 == 0)) return false;
  return s0 != 0 || s1 != 0 || t0 != 0 || t1 != 0 || !apart_on_line(c, e, f);
}

struct EdgeBox {
  Vec2 low, high;
  std::uint32_t edge;
};

}  // namespace

int side_of(const Cone& cone, std::uint32_t edge, std::uint32_t vertex) {
  const IntVec& d = cone.rays[vertex];
  const Vec3& normal = cone.normals[edge];
  const double x = static_cast<double>(d[0]), y = static_cast<double>(d[1]),
               z = static_cast<double>(d[2]);
  const double value = normal.x * x + normal.y * y + normal.z * z;
  if (std::abs(value) > 1e-14 * (std::abs(x) + std::abs(y) + std::abs(z)))
    return value > 0 ? 1 : -1;
  const Int128 exact = dot(cone.planes[edge], d);
  return exact > 0 ? 1 : exact < 0 ? -1 : 0;
}

/// In each cell edges are compared from left to right as far as their boxes overlap: where many
/// tiny edges share a cell, most pairs are never looked at. At worst, with many edges above one
/// another in one cell, all pairs are, but only their boxes.
bool are_simple(Cone& c, bool clean) {
  c.compared_pairs = 0;
  std::vector<EdgeBox> boxes;
  const double reach = 2 * nearest(c);
  for (int row = 0; row < c.grid.rows(); ++row)
    for (int column = 0; column < c.grid.columns(); ++column) {
      boxes.clear();
      for (const std::uint32_t e : c.grid.edges(column, row)) {
        const ContourGrid::Segment& s = c.grid.segment(e);
        boxes.push_back({glm::min(s.a, s.b) - reach, glm::max(s.a, s.b) + reach, e});
      }
      std::sort(boxes.begin(), boxes.end(),
                [](const EdgeBox& a, const EdgeBox& b) { return a.low.x < b.low.x; });
      for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t k = i + 1; k < boxes.size() && boxes[k].low.x <= boxes[i].high.x; ++k) {
          ++c.compared_pairs;
          if (boxes[k].low.y > boxes[i].high.y || boxes[k].high.y < boxes[i].low.y) continue;
          if (meet(c, boxes[i].edge, boxes[k].edge, clean)) return false;
        }
    }
  return true;
}

}  // namespace polyhull::hull
