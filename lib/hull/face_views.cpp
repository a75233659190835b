// SPDX-License-Identifier: LGPL-2.1-or-later
// The part of FaceClipper that looks at the face in another camera's picture.
#include <algorithm>
#include <cmath>

#include "hull/face_clipper.h"

namespace polyhull::hull {
namespace {

double cross2(const Vec2& a, const Vec2& b) {
  return a.x * b.y - a.y * b.x;
}
double reach(const Vec2& a) {
  return std::abs(a.x) + std::abs(a.y);
}

/// Whether all of a convex quadrilateral and a segment lie apart by the grid's margin, on two sides
/// of the segment's line or of a side of the quadrilateral.
bool apart(const std::array<Vec2, 4>& q, const Vec2& a, const Vec2& b) {
  const Vec2 d = b - a;
  const double margin = grid_margin * reach(d);
  int above = 0, below = 0;
  for (const Vec2& x : q) {
    const double s = cross2(d, x - a);
    above += s > margin, below += s < -margin;
  }
  if (above == 4 || below == 4) return true;
  for (int k = 1; k < 4; k += 2) {
    // The sides along the rays: corners 1-2 and 3-0, with the quadrilateral on one side.
    const Vec2 from = q[k], side = q[(k + 1) & 3] - from;
    const double size = reach(side);
    if (size < 1e-3) continue;
    const double s0 = cross2(side, a - from), s1 = cross2(side, b - from);
    const double own = cross2(side, q[(k + 2) & 3] - from) + cross2(side, q[(k + 3) & 3] - from);
    const double edge = grid_margin * size;
    if (own >= 0 ? s0 < -edge && s1 < -edge : s0 > edge && s1 > edge) return true;
  }
  return false;
}

}  // namespace

/// Finds the edges of the cone that may meet the face, or that there is none.
FaceClipper::Meeting FaceClipper::gather(const Cone& cone, const Picture& p) {
  ++stamp_now_;
  candidate_count_ = 0;
  const Mat3& m = cone.camera.to_pixel;
  const Vec3 a = m * p.a, b = m * p.b, d = m * p.d;
  const Extent& x = c_->extent;
  std::array<Vec2, 4> quad;
  Vec2 low(1e300), high(-1e300);
  bool all = x.endless;
  if (!all) {
    const double t[4] = {x.t0, x.t1, x.t1, x.t0}, w[4] = {x.w0, x.w0, x.w1, x.w1};
    for (int k = 0; k < 4; ++k) {
      const Vec3 q = a + t[k] * b + w[k] * d;
      const double size = std::abs(a.z) + std::abs(b.z * t[k]) + std::abs(d.z * w[k]);
      all = all || !(q.z > 1e-6 * size);
      quad[k] = Vec2(q) * (1.0 / q.z);
      low = glm::min(low, quad[k]), high = glm::max(high, quad[k]);
    }
  }
  if (all) {
    for (std::uint32_t e = 0; e < cone.size(); ++e) candidates_[candidate_count_++] = e;
    return Meeting::perhaps;
  }
  const ContourGrid& grid = cone.grid;
  int c0, c1, r0, r1;
  grid.column_range(low.x, high.x, c0, c1);
  grid.row_range(low.y, high.y, r0, r1);
  if (c0 > c1 || r0 > r1) return Meeting::outside;
  if (grid.occupied(c0, c1, r0, r1) == 0)
    return grid.state(c0, r0) == CellState::inside ? Meeting::inside : Meeting::outside;
  const Vec2 box_low = low - grid_margin, box_high = high + grid_margin;
  const auto take = [&](int column, int row) {
    for (std::uint32_t e : grid.edges(column, row)) {
      if (stamp_[e] == stamp_now_) continue;
      stamp_[e] = stamp_now_;
      const ContourGrid::Segment& segment = grid.segment(e);
      if (std::max(segment.a.x, segment.b.x) < box_low.x ||
          std::min(segment.a.x, segment.b.x) > box_high.x ||
          std::max(segment.a.y, segment.b.y) < box_low.y ||
          std::min(segment.a.y, segment.b.y) > box_high.y)
        continue;
      if (!apart(quad, segment.a, segment.b)) candidates_[candidate_count_++] = e;
    }
  };
  if (c0 == c1 || r0 == r1 || (c1 - c0 + 1) * (r1 - r0 + 1) <= 12) {
    for (int r = r0; r <= r1; ++r)
      for (int c = c0; c <= c1; ++c) take(c, r);
  } else {
    // The columns that the quadrilateral spans in each row of cells.
    rows_.assign(static_cast<std::size_t>(r1 - r0) + 1, {c1 + 1, c0 - 1});
    for (int k = 0; k < 4; ++k) {
      const Vec2 from = quad[k], to = quad[(k + 1) & 3];
      int first, last;
      grid.row_range(std::min(from.y, to.y), std::max(from.y, to.y), first, last);
      const double dy = to.y - from.y;
      const double slope = std::abs(dy) > 2 * grid_margin ? (to.x - from.x) / dy : 0.0;
      for (int r = std::max(first, r0); r <= std::min(last, r1); ++r) {
        double xa = from.x, xb = to.x;
        if (slope != 0.0) {
          const double top = grid.row_top(r) - grid_margin;
          const double bottom = grid.row_top(r + 1) + grid_margin;
          xa = from.x + (std::clamp(from.y, top, bottom) - from.y) * slope;
          xb = from.x + (std::clamp(to.y, top, bottom) - from.y) * slope;
        }
        int ca, cb;
        grid.column_range(std::min(xa, xb), std::max(xa, xb), ca, cb);
        auto& row = rows_[r - r0];
        row[0] = std::min(row[0], std::max(ca, c0));
        row[1] = std::max(row[1], std::min(cb, c1));
      }
    }
    for (int r = r0; r <= r1; ++r)
      for (int c = rows_[r - r0][0]; c <= rows_[r - r0][1]; ++c) take(c, r);
  }
  if (candidate_count_ > 0) return Meeting::perhaps;
  // No edge meets the quadrilateral: any of its points tells.
  for (const Vec2& corner : quad) {
    const Meeting meeting = locate(cone, corner);
    if (meeting != Meeting::perhaps) return meeting;
  }
  return Meeting::perhaps;
}

/// Where the point lies, if doubles can tell.
FaceClipper::Meeting FaceClipper::locate(const Cone& cone, const Vec2& x) const {
  const ContourGrid& grid = cone.grid;
  int c0, c1, r0, r1;
  grid.column_range(x.x, x.x, c0, c1);
  grid.row_range(x.y, x.y, r0, r1);
  if (c0 > c1 || r0 > r1) return Meeting::outside;
  if (grid.state(c0, r0) == CellState::unknown) return Meeting::perhaps;
  // Count the edges between here and the middle of the cell.
  const Vec2 middle = grid.centre(c0, r0), away = middle - x;
  bool inside = grid.state(c0, r0) == CellState::inside;
  const double tiny = 1e-6, close = tiny * reach(away);
  for (std::uint32_t e : grid.edges(c0, r0)) {
    const auto [a, b] = grid.segment(e);
    const double near = tiny * reach(b - a);
    const double s0 = cross2(b - a, x - a), s1 = cross2(b - a, middle - a);
    if ((s0 > near && s1 > near) || (s0 < -near && s1 < -near)) continue;
    const double t0 = cross2(away, a - x), t1 = cross2(away, b - x);
    if ((t0 > close && t1 > close) || (t0 < -close && t1 < -close)) continue;
    if (std::abs(s0) < near || std::abs(s1) < near || std::abs(t0) < close || std::abs(t1) < close)
      return Meeting::perhaps;
    inside = !inside;
  }
  return inside ? Meeting::inside : Meeting::outside;
}

/// Whether the loop of the node, which crosses no face of the cone, lies inside it.
bool FaceClipper::inside_cone(std::uint32_t node) {
  const Cone& cone = *cone_;
  const Picture& p = picture_;
  const Mat3& m = cone.camera.to_pixel;
  const Corner& v = c_->nodes[node].corner;
  if (v.tolerance < 1e-9) {
    const Vec3 d = v.h * p.a + v.t * p.b + v.w * p.d;
    const Vec3 q = m * d;
    const double size = std::abs(m[0][2] * d.x) + std::abs(m[1][2] * d.y) + std::abs(m[2][2] * d.z);
    if (q.z < -1e-6 * size) return cone.complement;
    if (q.z > 1e-6 * size) {
      const Meeting meeting = locate(cone, Vec2(q) / q.z);
      if (meeting != Meeting::perhaps) return (meeting == Meeting::inside) != cone.complement;
    }
  }
  return inside_cone_exact(node);
}

/// The same from all edges of the cone: along the edge's line from its first corner to infinity,
/// that end which is behind the cone's centre and so outside, count the faces on the way.
bool FaceClipper::inside_cone_exact(std::uint32_t node) {
  const Scene& s = *scene_;
  const Cone& cone = *cone_;
  const Picture& p = picture_;
  const std::uint32_t base = base_;
  const Edge e = c_->nodes[node].edge;
  const Corner from = c_->nodes[node].corner;
  // The line's point at infinity: the plane at infinity is w = 0 in a cone's chart, h = 0 in a
  // box's.
  const Line infinite = c_->cone >= 0 ? Line{0, 0, 1} : Line{1, 0, 0};
  Corner to{};
  to.h = e.line.b * infinite.d - e.line.d * infinite.b;
  to.t = e.line.d * infinite.a - e.line.a * infinite.d;
  to.w = e.line.a * infinite.b - e.line.b * infinite.a;
  to.tolerance = 4 * determinant_error;
  const Vec3 direction = to.h * p.a + to.t * p.b + to.w * p.d;
  int sign = glm::dot(cone.camera.forward, direction) > 0 ? -1 : 1;
  to.h *= sign, to.t *= sign, to.w *= sign;
  to.plane1 = e.plane;
  to.plane2 = s.infinity();
  to.sign = static_cast<std::int8_t>(sign * e.orientation);
  to.apex = false;
  bool inside = cone.complement;
  for (std::uint32_t k = 0; k < cone.size(); ++k) {
    const Line line = line_of(cone.normals[k], p);
    const int s0 = side(from, base + k, line), s1 = side(to, base + k, line);
    if (s0 == s1) continue;
    const std::uint32_t before = cone.previous[k], after = cone.next[k];
    Corner x{};
    x.plane1 = e.plane, x.plane2 = base + k;
    x.apex = false;
    const double a = std::abs(value(from, line)), b = std::abs(value(to, line));
    x.h = b * from.h + a * to.h, x.t = b * from.t + a * to.t, x.w = b * from.w + a * to.w;
    x.tolerance = undecided;
    // to = sign (e x infinity) and k's line has the sign s1 there, so det(e, k, infinity) has the
    // sign of -s1 sign; x = s (e x k) is on infinity's positive side.
    x.sign = static_cast<std::int8_t>(-s1 * sign * e.orientation);
    if (side(x, base + before, line_of(cone.normals[before], p)) == cone.turn[k] &&
        side(x, base + after, line_of(cone.normals[after], p)) == cone.turn[after])
      inside = !inside;
  }
  return inside;
}

}  // namespace polyhull::hull
