// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/clean_region.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "hull/exact/exact_integer.h"

namespace polyhull::hull {
namespace {

struct Point {
  std::int64_t x = 0, y = 0;
  auto operator<=>(const Point&) const = default;
};

Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y};
}
/// Coordinates are below 2^31, differences below 2^32.
Int128 exact_cross(const Point& a, const Point& b) {
  return static_cast<Int128>(a.x) * b.y - static_cast<Int128>(a.y) * b.x;
}
Int128 dot(const Point& a, const Point& b) {
  return static_cast<Int128>(a.x) * b.x + static_cast<Int128>(a.y) * b.y;
}
int sign(Int128 v) {
  return v > 0 ? 1 : v < 0 ? -1 : 0;
}

struct Segment {
  Point a, b;
  std::uint32_t layer, source;
  std::int32_t view;
};

/// An edge of the finished subdivision, a < b, with the layers whose boundary it is.
struct Piece {
  Point a, b;
  std::uint64_t layers;
  std::uint32_t source;
  std::int32_t view;
};

/// Whether the segment passes the point at less than sqrt(1/2) grid steps.
bool near(const Point& p, const Segment& s) {
  const Point d = s.b - s.a, e = p - s.a;
  const Int128 along = dot(d, e), length = dot(d, d);
  if (along < 0) return 2 * dot(e, e) < 1;
  if (along > length) return p == s.b;
  const double off = static_cast<double>(exact_cross(d, e));
  return 2 * off * off < static_cast<double>(length);
}

/// One round of splitting at crossings and near points; false if there was nothing to split.
bool split(std::vector<Segment>& segments) {
  std::sort(segments.begin(), segments.end(), [](const Segment& s, const Segment& t) {
    return std::min(s.a.x, s.b.x) < std::min(t.a.x, t.b.x);
  });
  std::vector<std::pair<std::uint32_t, Point>> splits;
  const auto at = [&](std::uint32_t i, const Point& p) {
    if (p != segments[i].a && p != segments[i].b) splits.push_back({i, p});
  };
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    const Segment& s = segments[i];
    const std::int64_t right = std::max(s.a.x, s.b.x) + 1;
    const std::int64_t low = std::min(s.a.y, s.b.y) - 1, high = std::max(s.a.y, s.b.y) + 1;
    for (std::uint32_t k = i + 1; k < segments.size(); ++k) {
      const Segment& t = segments[k];
      if (std::min(t.a.x, t.b.x) > right) break;
      if (std::min(t.a.y, t.b.y) > high || std::max(t.a.y, t.b.y) < low) continue;
      bool touched = false;
      for (const Point& p : {t.a, t.b})
        if (p != s.a && p != s.b && near(p, s)) at(i, p), touched = true;
      for (const Point& p : {s.a, s.b})
        if (p != t.a && p != t.b && near(p, t)) at(k, p), touched = true;
      if (touched) continue;
      const Point d = s.b - s.a, e = t.b - t.a;
      const Int128 s0 = exact_cross(d, t.a - s.a), s1 = exact_cross(d, t.b - s.a);
      const Int128 t0 = exact_cross(e, s.a - t.a), t1 = exact_cross(e, s.b - t.a);
      if (sign(s0) * sign(s1) >= 0 || sign(t0) * sign(t1) >= 0) continue;
      const double f = static_cast<double>(t0) / static_cast<double>(t0 - t1);
      const Point p{s.a.x + std::llrint(f * static_cast<double>(d.x)),
                    s.a.y + std::llrint(f * static_cast<double>(d.y))};
      at(i, p);
      at(k, p);
    }
  }
  if (splits.empty()) return false;
  std::sort(splits.begin(), splits.end(), [&](const auto& x, const auto& y) {
    if (x.first != y.first) return x.first < y.first;
    const Segment& s = segments[x.first];
    const Int128 u = dot(s.b - s.a, x.second - s.a), v = dot(s.b - s.a, y.second - s.a);
    return u != v ? u < v : x.second < y.second;
  });
  std::vector<Segment> result;
  std::size_t next = 0;
  for (std::uint32_t i = 0; i < segments.size(); ++i) {
    Segment s = segments[i];
    const Point end = s.b;
    for (; next < splits.size() && splits[next].first == i; ++next) {
      s.b = splits[next].second;
      if (s.a != s.b) result.push_back(s);
      s.a = s.b;
    }
    s.b = end;
    if (s.a != s.b) result.push_back(s);
  }
  segments = std::move(result);
  return true;
}

/// Segments on top of each other made one; those that cancel out are dropped.
std::vector<Piece> unite(std::vector<Segment>& segments) {
  for (Segment& s : segments)
    if (s.b < s.a) std::swap(s.a, s.b);
  std::sort(segments.begin(), segments.end(), [](const Segment& s, const Segment& t) {
    return std::tie(s.a, s.b, s.layer, s.source) < std::tie(t.a, t.b, t.layer, t.source);
  });
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < segments.size();) {
    Piece p{segments[i].a, segments[i].b, 0, segments[i].source, segments[i].view};
    for (; i < segments.size() && segments[i].a == p.a && segments[i].b == p.b; ++i)
      p.layers ^= std::uint64_t{1} << segments[i].layer;
    if (p.layers != 0) pieces.push_back(p);
  }
  return pieces;
}

/// For each piece, in which layers the points just below it (at lower y; for vertical pieces, just
/// left of it) lie: the parity of the pieces further that way.
std::vector<std::uint64_t> layers_below(const std::vector<Piece>& pieces) {
  std::vector<std::uint64_t> result(pieces.size(), 0);
  if (pieces.empty()) return result;
  for (const bool vertical : {false, true}) {
    const auto along = [&](const Point& p) { return vertical ? p.y : p.x; };
    const auto across = [&](const Point& p) { return vertical ? p.x : p.y; };
    std::int64_t low = INT64_MAX, high = INT64_MIN;
    for (const Piece& p : pieces) {
      low = std::min({low, along(p.a), along(p.b)});
      high = std::max({high, along(p.a), along(p.b)});
    }
    const std::int64_t buckets = static_cast<std::int64_t>(pieces.size()) / 2 + 1;
    const std::int64_t width = (high - low) / buckets + 1;
    std::vector<std::vector<std::uint32_t>> lists(buckets);
    for (std::uint32_t i = 0; i < pieces.size(); ++i) {
      const std::int64_t u = along(pieces[i].a), v = along(pieces[i].b);
      for (std::int64_t b = (std::min(u, v) - low) / width; b <= (std::max(u, v) - low) / width;
           ++b)
        lists[b].push_back(i);
    }
    for (std::uint32_t i = 0; i < pieces.size(); ++i) {
      const Piece& p = pieces[i];
      if ((p.a.x == p.b.x) != vertical) continue;
      // The middle of the piece, in doubled coordinates.
      const std::int64_t u = along(p.a) + along(p.b), v = across(p.a) + across(p.b);
      for (std::uint32_t k : lists[((u >> 1) - low) / width]) {
        if (k == i) continue;
        const Piece& q = pieces[k];
        Point a = q.a, b = q.b;
        if (along(b) < along(a)) std::swap(a, b);
        if (!(2 * along(a) <= u && u < 2 * along(b))) continue;
        // Is q's point at u below v?
        const Int128 run = along(b) - along(a), rise = across(b) - across(a);
        if (2 * across(a) * run + rise * (u - 2 * along(a)) < v * run) result[i] ^= q.layers;
      }
    }
  }
  return result;
}

struct Arc {
  Point from, to;
  std::uint32_t source;
  std::int32_t view;
  bool used = false;
};

/// Whether direction p comes before q when turning clockwise from \p base.
bool clockwise_before(const Point& base, const Point& p, const Point& q) {
  const auto half = [&](const Point& d) {
    const int s = sign(exact_cross(base, d));
    return s < 0 ? 0 : s == 0 ? 1 : 2;
  };
  const int a = half(p), b = half(q);
  return a != b ? a < b : exact_cross(p, q) < 0;
}

std::uint64_t point_key(const Point& p) {
  return static_cast<std::uint64_t>(p.x) * 0x9e3779b97f4a7c15u ^
         (static_cast<std::uint64_t>(p.y) * 0xc2b2ae3d27d4eb4fu >> 7);
}
struct PointHash {
  std::size_t operator()(const Point& p) const { return point_key(p); }
};

Contours trace(std::vector<Arc>& arcs, double step) {
  std::unordered_map<Point, std::vector<std::uint32_t>, PointHash> leaving;
  for (std::uint32_t i = 0; i < arcs.size(); ++i) leaving[arcs[i].from].push_back(i);
  Contours out;
  for (std::uint32_t first = 0; first < arcs.size(); ++first) {
    const std::size_t begin = out.points.size();
    for (std::uint32_t i = first; !arcs[i].used;) {
      Arc& arc = arcs[i];
      arc.used = true;
      out.points.push_back(Vec2(static_cast<double>(arc.from.x), static_cast<double>(arc.from.y)) *
                           step);
      out.source.push_back(arc.source);
      out.view.push_back(arc.view);
      // The solid is on the left; its next border is the first clockwise from where we came.
      const Point back = arc.from - arc.to;
      const std::vector<std::uint32_t>& choices = leaving[arc.to];
      std::uint32_t best = choices.front();
      for (std::uint32_t c : choices)
        if (clockwise_before(back, arcs[c].to - arc.to, arcs[best].to - arc.to)) best = c;
      i = best;
    }
    if (out.points.size() == begin) continue;
    if (out.points.size() < begin + 3) {
      out.points.resize(begin), out.source.resize(begin), out.view.resize(begin);
      continue;
    }
    out.ends.push_back(static_cast<std::uint32_t>(out.points.size()));
  }
  return out;
}

}  // namespace

Contours clean_region(std::span<const Contours> layers, bool complement, double grid_step_factor) {
  if (layers.size() > 64) {
    // A solid's boundary in even-odd form is again a layer.
    std::vector<Contours> fewer(layers.begin(), layers.begin() + 63);
    Contours rest = clean_region(layers.subspan(63), complement, grid_step_factor);
    // The intersection of complements is the complement of what their boundaries enclose.
    fewer.push_back(std::move(rest));
    return clean_region(fewer, complement, grid_step_factor);
  }
  double largest = 1.0;
  for (const Contours& layer : layers)
    for (const Vec2& p : layer.points) largest = std::max({largest, std::abs(p.x), std::abs(p.y)});
  const double step =
      std::max(std::ldexp(1.0, -12), std::ldexp(1.0, std::ilogb(largest) - 28)) * grid_step_factor;
  std::vector<Segment> segments;
  for (std::uint32_t l = 0; l < layers.size(); ++l) {
    const Contours& layer = layers[l];
    std::uint32_t begin = 0;
    const auto round = [&](const Vec2& p) {
      return Point{std::llrint(p.x / step), std::llrint(p.y / step)};
    };
    for (std::uint32_t end : layer.ends) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const Point a = round(layer.points[i]),
                    b = round(layer.points[i + 1 < end ? i + 1 : begin]);
        if (a != b) segments.push_back({a, b, l, layer.source[i], layer.view[i]});
      }
      begin = end;
    }
  }
  for (int round = 0; round < 64 && split(segments); ++round) {
  }
  std::vector<Piece> pieces = unite(segments);
  const std::vector<std::uint64_t> below = layers_below(pieces);
  const std::uint64_t all =
      layers.size() == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << layers.size()) - 1;
  const auto solid = [&](std::uint64_t in) { return complement ? in == 0 : in == all; };
  std::vector<Arc> arcs;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& p = pieces[i];
    const bool low = solid(below[i]), high = solid(below[i] ^ p.layers);
    if (low == high) continue;
    // From a to b, x grows and higher y is on the left; on a vertical piece y grows and lower x is.
    const bool forward = p.a.x == p.b.x ? low : high;
    if (forward)
      arcs.push_back({p.a, p.b, p.source, p.view});
    else
      arcs.push_back({p.b, p.a, p.source, p.view});
  }
  return trace(arcs, step);
}

}  // namespace polyhull::hull
