// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/ring_checks.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "silhouette/contour/trace.h"

namespace polyhull::test {
namespace {

/// Twice the signed area of a triangle in units of 1/512 px.
std::int64_t turn(Vec2f a, Vec2f b, Vec2f c) {
  const auto u = [](float v) { return static_cast<std::int64_t>(std::llround(v * 512.0)); };
  return (u(b.x) - u(a.x)) * (u(c.y) - u(a.y)) - (u(b.y) - u(a.y)) * (u(c.x) - u(a.x));
}

bool between(Vec2f a, Vec2f b, Vec2f p) {
  return std::min(a.x, b.x) <= p.x && p.x <= std::max(a.x, b.x) && std::min(a.y, b.y) <= p.y &&
         p.y <= std::max(a.y, b.y);
}

double distance_to_segment(double px, double py, Vec2f a, Vec2f b) {
  const double dx = static_cast<double>(b.x) - a.x, dy = static_cast<double>(b.y) - a.y;
  const double length2 = dx * dx + dy * dy;
  double t = length2 > 0.0 ? ((px - a.x) * dx + (py - a.y) * dy) / length2 : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  return std::hypot(px - a.x - t * dx, py - a.y - t * dy);
}

}  // namespace

std::vector<Segment> segments_of(const Rings& rings) {
  std::vector<Segment> out;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const auto ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i)
      out.push_back({ring[i], ring[(i + 1) % ring.size()], r, i, ring.size()});
  }
  return out;
}

bool segments_meet(const Segment& s, const Segment& t) {
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

std::string meeting_edges(const Rings& rings) {
  std::vector<Segment> all = segments_of(rings);
  for (std::size_t r = 0; r < rings.size(); ++r)
    if (rings.ring(r).size() < 3)
      return "ring " + std::to_string(r) + " has " + std::to_string(rings.ring(r).size()) +
             " vertices";
  for (const Segment& s : all)
    if (s.a == s.b) return "edge without length in ring " + std::to_string(s.ring);
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
        return "edge " + std::to_string(all[i].index) + " of ring " + std::to_string(all[i].ring) +
               " meets edge " + std::to_string(all[j].index) + " of ring " +
               std::to_string(all[j].ring) + " near (" + std::to_string(all[i].a.x) + ", " +
               std::to_string(all[i].a.y) + ")";
    }
  return {};
}

bool contains(std::span<const Vec2f> ring, double x, double y) {
  bool inside = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vec2f a = ring[j], b = ring[i];
    if ((a.y <= y) == (b.y <= y)) continue;
    if (a.x + (y - a.y) / (static_cast<double>(b.y) - a.y) * (static_cast<double>(b.x) - a.x) > x)
      inside = !inside;
  }
  return inside;
}

std::string nesting_fault(const Rings& rings) {
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const Vec2f p = rings.ring(i)[0];
    int around = 0;
    for (std::size_t j = 0; j < rings.size(); ++j)
      around += i != j && contains(rings.ring(j), p.x, p.y);
    const bool hole = ring_area(rings.ring(i)) < 0.0;
    if ((around % 2 == 1) != hole)
      return "ring " + std::to_string(i) + (hole ? " (a hole)" : " (outer)") + " lies inside " +
             std::to_string(around) + " others";
  }
  return {};
}

double total_area(const Rings& rings) {
  double area = 0.0;
  for (std::size_t i = 0; i < rings.size(); ++i) area += ring_area(rings.ring(i));
  return area;
}

double total_length(const Rings& rings) {
  double length = 0.0;
  for (const Segment& s : segments_of(rings)) length += std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
  return length;
}

double one_sided_distance(const Rings& from, const Rings& to, double step) {
  // The targets in horizontal bands, searched from the point's own outwards.
  constexpr double height = 8.0;
  const std::vector<Segment> targets = segments_of(to);
  float low = 1e30f, high = -1e30f;
  for (const Segment& s : targets) {
    low = std::min({low, s.a.y, s.b.y});
    high = std::max({high, s.a.y, s.b.y});
  }
  if (targets.empty()) return from.empty() ? 0.0 : 1e30;
  const int count = static_cast<int>((high - low) / height) + 1;
  std::vector<std::vector<Segment>> bands(static_cast<std::size_t>(count));
  for (const Segment& s : targets)
    for (int b = static_cast<int>((std::min(s.a.y, s.b.y) - low) / height);
         b <= static_cast<int>((std::max(s.a.y, s.b.y) - low) / height); ++b)
      bands[static_cast<std::size_t>(b)].push_back(s);
  double most = 0.0;
  for (const Segment& s : segments_of(from)) {
    const double length = std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
    const int n = std::max(1, static_cast<int>(std::ceil(length / step)));
    for (int i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) / n;
      const double px = s.a.x + t * (s.b.x - s.a.x), py = s.a.y + t * (s.b.y - s.a.y);
      const int own = std::clamp(static_cast<int>((py - low) / height), 0, count - 1);
      double best = 1e30;
      for (int away = 0; away < count; ++away) {
        for (const int b : {own - away, own + away}) {
          if (b < 0 || b >= count || (away == 0 && b != own)) continue;
          for (const Segment& other : bands[static_cast<std::size_t>(b)]) {
            if (std::min(other.a.x, other.b.x) - px > best ||
                px - std::max(other.a.x, other.b.x) > best)
              continue;
            best = std::min(best, distance_to_segment(px, py, other.a, other.b));
          }
        }
        // The next bands are at least this far.
        const double beyond =
            std::min(py - (low + (own - away) * height), low + (own + away + 1) * height - py);
        if (beyond > best) break;
      }
      most = std::max(most, best);
    }
  }
  return most;
}

namespace {

double area_above(const Field& field, double level) {
  const int w = field.width, h = field.height;
  // Beyond the frame the border's values go on, up to half a pixel.
  const auto value = [&](int x, int y) {
    return field.row(std::clamp(y, 0, h - 1))[std::clamp(x, 0, w - 1)] - level;
  };
  double area = 0.0;
  for (int y = -1; y < h; ++y)
    for (int x = -1; x < w; ++x) {
      // Corners in the order of a way around the cell, clipped to the frame.
      struct Corner {
        double x, y, v;
      };
      const double x0 = std::max(x + 0.0, -0.5), x1 = std::min(x + 1.0, w - 0.5);
      const double y0 = std::max(y + 0.0, -0.5), y1 = std::min(y + 1.0, h - 0.5);
      const std::array<Corner, 4> c = {{{x0, y0, value(x, y)},
                                        {x1, y0, value(x + 1, y)},
                                        {x1, y1, value(x + 1, y + 1)},
                                        {x0, y1, value(x, y + 1)}}};
      const double whole = (x1 - x0) * (y1 - y0);
      int inside = 0;
      for (const Corner& k : c) inside += k.v >= 0.0;
      if (inside == 0) continue;
      if (inside == 4) {
        area += whole;
        continue;
      }
      // Where an edge passes the level, as a fraction of it.
      const auto cut = [&](int i) {
        const Corner &a = c[i], &b = c[(i + 1) % 4];
        return a.v / (a.v - b.v);
      };
      // The triangle that corner i has to itself.
      const auto own = [&](int i) {
        const int before = (i + 3) % 4;
        const Corner &k = c[i], &n = c[(i + 1) % 4], &p = c[before];
        return 0.5 * cut(i) * std::hypot(n.x - k.x, n.y - k.y) * (1.0 - cut(before)) *
               std::hypot(p.x - k.x, p.y - k.y);
      };
      const bool saddle = inside == 2 && (c[0].v >= 0.0) == (c[2].v >= 0.0);
      if (saddle) {
        const bool joined = c[0].v + c[1].v + c[2].v + c[3].v >= 0.0;
        const int first = (c[0].v >= 0.0) == joined ? 1 : 0;  // corners cut off, or all there is
        const double pieces = own(first) + own(first + 2);
        area += joined ? whole - pieces : pieces;
        continue;
      }
      // One polygon: the inside corners and the two cuts.
      std::vector<std::array<double, 2>> polygon;
      for (int i = 0; i < 4; ++i) {
        const Corner &a = c[i], &b = c[(i + 1) % 4];
        if (a.v >= 0.0) polygon.push_back({a.x, a.y});
        if ((a.v >= 0.0) == (b.v >= 0.0)) continue;
        const double t = cut(i);
        polygon.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
      }
      double twice = 0.0;
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        twice += a[0] * b[1] - b[0] * a[1];
      }
      area += 0.5 * twice;
    }
  return area;
}

}  // namespace

AreaBounds marching_area(const Field& field) {
  return {area_above(field, field_half), area_above(field, field_half - 1 + 1e-6)};
}

std::string misplaced_pixel(const Rings& rings, const Field& field) {
  const std::vector<Segment> edges = segments_of(rings);
  std::vector<double> crossings;
  for (int y = 0; y < field.height; ++y) {
    crossings.clear();
    for (const Segment& s : edges) {
      if ((s.a.y <= y) == (s.b.y <= y)) continue;
      crossings.push_back(s.a.x + (y - s.a.y) / (static_cast<double>(s.b.y) - s.a.y) *
                                      (static_cast<double>(s.b.x) - s.a.x));
    }
    std::sort(crossings.begin(), crossings.end());
    std::size_t passed = 0;
    for (int x = 0; x < field.width; ++x) {
      while (passed < crossings.size() && crossings[passed] <= x) ++passed;
      if ((passed % 2 == 1) != (field.row(y)[x] >= field_half))
        return "pixel (" + std::to_string(x) + ", " + std::to_string(y) + ") of value " +
               std::to_string(field.row(y)[x]) + " is on the wrong side";
    }
  }
  return {};
}

}  // namespace polyhull::test
