// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/faces/cone_view.h"

#include <algorithm>
#include <cmath>

#include "hull/exact/pair.h"

namespace polyhull::hull {
namespace {

double reach(const Vec2& a) {
  return std::abs(a.x) + std::abs(a.y);
}

/// Points known to this many pixels can be located: the grid's centres of cells keep twice as far
/// from all edges.
constexpr double locatable = 5e-5;

double larger(double a, double b) {
  return std::max(std::abs(a), std::abs(b));
}

}  // namespace

/// What of the picture a face covers, and whether an edge comes near. Written without branches:
/// which of its tests an edge fails is random.
struct ConeView::Quadrilateral {
  /// The corners at the far end of the rays and at the near end, each along the contour edge.
  Pair far_x, far_y, near_x, near_y;
  double margin;   ///< the grid's
  Pair low, high;  ///< the box around them, with the margin
  /// The lines of the sides along the rays, positive on the quadrilateral.
  Pair side_x{}, side_y{}, side_offset{};

  /// Where the extent appears; returns the least depth of its corners (up to 0: the rest is
  /// meaningless).
  double project(const Vec3& a, const Vec3& b, const Vec3& d, const Extent& e) {
    const Pair t{e.t0, e.t1};
    const Pair x = a.x + t * b.x, y = a.y + t * b.y, z = a.z + t * b.z;
    const Pair far_z = z + e.w0 * d.z, near_z = z + e.w1 * d.z;
    const Pair far_inverse = 1.0 / far_z, near_inverse = 1.0 / near_z;
    far_x = (x + e.w0 * d.x) * far_inverse, far_y = (y + e.w0 * d.y) * far_inverse;
    near_x = (x + e.w1 * d.x) * near_inverse, near_y = (y + e.w1 * d.y) * near_inverse;
    const Pair low_x = least(far_x, near_x), high_x = most(far_x, near_x);
    const Pair low_y = least(far_y, near_y), high_y = most(far_y, near_y);
    low = least(firsts(low_x, low_y), seconds(low_x, low_y)) - margin;
    high = most(firsts(high_x, high_y), seconds(high_x, high_y)) + margin;
    const Pair depth = least(far_z, near_z);
    return std::min(depth[0], depth[1]);
  }

  /// Around the quadrilateral.
  Vec2 corner(int k) const {
    const int end = k == 1 || k == 2;
    return k < 2 ? Vec2(far_x[end], far_y[end]) : Vec2(near_x[end], near_y[end]);
  }

  void find_sides() {
    // From the far to the near end at the second ray, back at the first.
    const Pair from_x{far_x[1], near_x[0]}, from_y{far_y[1], near_y[0]};
    const Pair to_x{near_x[1], far_x[0]}, to_y{near_y[1], far_y[0]};
    const Pair dx = to_x - from_x, dy = to_y - from_y;
    const Pair size = absolute(dx) + absolute(dy);
    const Pair offset = dy * from_x - dx * from_y;
    const Pair other_x = swapped(from_x + to_x), other_y = swapped(from_y + to_y);
    const Pair own = dx * other_y - dy * other_x + 2.0 * offset;
    const Pair sign = own >= 0.0 ? Pair{1, 1} : Pair{-1, -1};
    const auto short_side = size < 0.1 * margin;
    side_x = short_side ? Pair{} : -dy * sign;
    side_y = short_side ? Pair{} : dx * sign;
    side_offset = short_side ? Pair{1, 1} : offset * sign + margin * size;
  }

  /// False if the quadrilateral and the segment lie apart by the grid's margin: on two sides of the
  /// segment's line or of a side along the rays.
  bool meets(const ContourGrid::Segment& s) const {
    const double dx = s.b.x - s.a.x, dy = s.b.y - s.a.y, offset = dx * s.a.y - dy * s.a.x;
    const double apart_by = margin * (std::abs(dx) + std::abs(dy));
    const Pair v = dx * far_y - dy * far_x - offset;
    const Pair w = dx * near_y - dy * near_x - offset;
    const Pair beyond =
        most(side_x * s.a.x + side_y * s.a.y, side_x * s.b.x + side_y * s.b.y) + side_offset;
    const bool apart = both(least(v, w) > apart_by) | both(most(v, w) < -apart_by);
    return !(apart | any(beyond < 0.0));
  }

  /// The same of the boxes around them.
  bool near(const ContourGrid::Segment& s) const {
    const Pair a{s.a.x, s.a.y}, b{s.b.x, s.b.y};
    return (bits(most(a, b) < low) | bits(least(a, b) > high)) == 0;
  }
};

void ConeView::begin(std::size_t most) {
  stamp_.assign(most, 0);
  line_stamp_.assign(most, 0);
  lines_.resize(most);
  candidates_.resize(most + 1);
  stamp_now_ = look_now_ = 0;
}

void ConeView::look_from(std::uint32_t index) {
  ++look_now_;
  cone_ = chart_.problem->cones[index];
  base_ = chart_.problem->first_face[index];
  axes_ = chart_.seen_from(cone_->centre_real);
  const Mat3& m = cone_->camera.to_pixel;
  pixel_a_ = m * axes_.a, pixel_b_ = m * axes_.b, pixel_d_ = m * axes_.d;
}

/// How far off the pixel of (1, t, w) can be, whose coordinates add up to \p sum, at the depth \p
/// z. A corner's tolerance is twenty times the error of a cross product over the same determinant,
/// and that error comes to each coordinate once for itself and once for the determinant.
double ConeView::pixel_error(double tolerance, double sum, const Vec2& pixel, double z) const {
  const double e = 0.05 * tolerance * (3 + sum);
  if (!(z > 2 * e * cone_->depth_scale)) return 1e300;
  return 2 * e * (cone_->pixel_scale + larger(pixel.x, pixel.y) * cone_->depth_scale) / z;
}

ConeView::Meeting ConeView::gather(const Extent& x) {
  const Cone& cone = *cone_;
  const ContourGrid& grid = cone.grid;
  Quadrilateral quad;
  quad.margin = grid.margin();
  double error = 1e300;  // of the corners, in pixels
  if (!x.endless) {
    const double depth = quad.project(pixel_a_, pixel_b_, pixel_d_, x);
    error = pixel_error(x.error, larger(x.t0, x.t1) + larger(x.w0, x.w1),
                        Vec2(larger(quad.low[0], quad.high[0]), larger(quad.low[1], quad.high[1])),
                        depth);
  }
  if (!(error < 0.5 * grid.margin())) {
    for (std::uint32_t e = 0; e < cone.size(); ++e) candidates_[e] = e;
    candidate_count_ = static_cast<std::uint32_t>(cone.size());
    return Meeting::perhaps;
  }
  const ContourGrid::Block block = grid.block(quad.low, quad.high);
  if (block.empty()) return Meeting::outside;
  if (grid.occupied(block) == 0)
    return grid.state(block.column0, block.row0) == CellState::inside ? Meeting::inside
                                                                      : Meeting::outside;
  return gather_edges(quad, block, error);
}

/// The columns that the quadrilateral spans in each row of the block's cells.
void ConeView::find_rows(const Quadrilateral& quad, const ContourGrid::Block& block) {
  const ContourGrid& grid = cone_->grid;
  const auto [c0, c1, r0, r1] = block;
  const double leftmost = c0, rightmost = c1, top = r0, bottom = r1;
  rows_.assign(static_cast<std::size_t>(r1 - r0) + 1, {c1 + 1, c0 - 1});
  for (int k = 0; k < 4; ++k) {
    // In cells, downwards.
    Vec2 from = grid.in_cells(quad.corner(k)), to = grid.in_cells(quad.corner((k + 1) & 3));
    if (from.y > to.y) std::swap(from, to);
    const double margin = grid.margin_in_cells(), dy = to.y - from.y;
    const double least_x = std::clamp(std::min(from.x, to.x) - margin, leftmost, rightmost + 1);
    const double most_x = std::clamp(std::max(from.x, to.x) + margin, leftmost - 1, rightmost);
    // How far the line is to the left and to the right of where it enters a row.
    const bool level = dy <= 2 * margin;
    const double slope = level ? 0.0 : (to.x - from.x) / dy;
    const double left = std::min(slope, 0.0) - margin - std::abs(slope) * margin;
    const double right = std::max(slope, 0.0) + margin + std::abs(slope) * margin;
    const int first = static_cast<int>(std::clamp(from.y - margin, top, bottom + 1));
    const int last = static_cast<int>(std::clamp(to.y + margin, top - 1, bottom));
    for (int r = first; r <= last; ++r) {
      const double x = from.x + (r - from.y) * slope;
      const double low = level ? least_x : std::clamp(x + left, least_x, rightmost + 1);
      const double high = level ? most_x : std::clamp(x + right, leftmost - 1, most_x);
      auto& row = rows_[r - r0];
      row[0] = std::min(row[0], static_cast<int>(low));
      row[1] = std::max(row[1], static_cast<int>(high));
    }
  }
}

/// The same where the box around the picture has edges in its \p block of cells.
ConeView::Meeting ConeView::gather_edges(Quadrilateral& quad, const ContourGrid::Block& block,
                                         double error) {
  const Cone& cone = *cone_;
  const ContourGrid& grid = cone.grid;
  const auto [c0, c1, r0, r1] = block;
  const std::uint32_t now = ++stamp_now_;
  std::uint32_t count = 0;
  const auto take = [&](int column0, int column1, int row) {
    if (column0 > column1) return;
    for (const std::uint32_t e : grid.edges(column0, column1, row)) {
      candidates_[count] = e;
      count += (stamp_[e] != now) & quad.near(grid.segment(e));
      stamp_[e] = now;
    }
  };
  if (c0 == c1 || r0 == r1 || (c1 - c0 + 1) * (r1 - r0 + 1) <= 12) {
    for (int r = r0; r <= r1; ++r) take(c0, c1, r);
  } else {
    find_rows(quad, block);
    for (int r = r0; r <= r1; ++r) take(rows_[r - r0][0], rows_[r - r0][1], r);
  }
  candidate_count_ = 0;
  if (count > 0) quad.find_sides();
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t e = candidates_[i];
    candidates_[candidate_count_] = e;
    candidate_count_ += quad.meets(grid.segment(e));
  }
  if (candidate_count_ > 0) return Meeting::perhaps;
  // No edge meets the quadrilateral: any of its points tells, soonest one far from all edges.
  for (const bool anywhere : {false, true})
    for (int k = 0; k < 4; ++k) {
      const Vec2 corner = quad.corner(k);
      if (!anywhere && !grid.empty_at(corner)) continue;
      const Meeting meeting = locate(corner, error);
      if (meeting != Meeting::perhaps) return meeting;
    }
  return Meeting::perhaps;
}

/// Where the point lies, which is off by \p error pixels at most, if doubles can tell.
ConeView::Meeting ConeView::locate(const Vec2& x, double error) const {
  const Cone& cone = *cone_;
  const double tiny = 1e-6 + cone.pixel_error + error;
  if (!(tiny < locatable)) return Meeting::perhaps;
  const ContourGrid& grid = cone.grid;
  int c0, c1, r0, r1;
  grid.column_range(x.x, x.x, c0, c1);
  grid.row_range(x.y, x.y, r0, r1);
  if (c0 > c1 || r0 > r1) return Meeting::outside;
  if (grid.state(c0, r0) == CellState::unknown) return Meeting::perhaps;
  // Count the edges between here and the middle of the cell.
  const Vec2 middle = grid.centre(c0, r0), away = middle - x;
  bool inside = grid.state(c0, r0) == CellState::inside;
  const double close = tiny * reach(away);
  for (std::uint32_t e : grid.edges(c0, r0)) {
    const auto [a, b] = grid.segment(e);
    const double near = tiny * reach(b - a);
    const double s0 = cross(b - a, x - a), s1 = cross(b - a, middle - a);
    if ((s0 > near && s1 > near) || (s0 < -near && s1 < -near)) continue;
    const double t0 = cross(away, a - x), t1 = cross(away, b - x);
    if ((t0 > close && t1 > close) || (t0 < -close && t1 < -close)) continue;
    if (std::abs(s0) < near || std::abs(s1) < near || std::abs(t0) < close || std::abs(t1) < close)
      return Meeting::perhaps;
    inside = !inside;
  }
  return inside ? Meeting::inside : Meeting::outside;
}

bool ConeView::inside(const Node& node) {
  const Cone& cone = *cone_;
  const Corner& v = node.corner;
  if (v.tolerance < 1e-9) {
    const Vec3 q = v.h * pixel_a_ + v.t * pixel_b_ + v.w * pixel_d_;
    const Vec2 pixel = Vec2(q) / q.z;
    const double sum = std::abs(v.t) + std::abs(v.w);
    if (pixel_error(v.tolerance, sum, pixel, -q.z) < 1e300) return cone.complement;  // behind
    const Meeting meeting = locate(pixel, pixel_error(v.tolerance, sum, pixel, q.z));
    if (meeting != Meeting::perhaps) return (meeting == Meeting::inside) != cone.complement;
  }
  return inside_exactly(node);
}

/// The same from all edges of the cone: along the edge's line from its first corner to infinity,
/// that end which is behind the cone's centre and so outside, count the faces on the way.
bool ConeView::inside_exactly(const Node& node) {
  const Cone& cone = *cone_;
  const Edge& e = node.edge;
  const Corner& from = node.corner;
  // The line's point at infinity: the plane at infinity is w = 0 in a cone's chart, h = 0 in a
  // box's.
  const Line infinite = chart_.cone >= 0 ? Line{0, 0, 1} : Line{1, 0, 0};
  Corner to{};
  to.h = e.line.b * infinite.d - e.line.d * infinite.b;
  to.t = e.line.d * infinite.a - e.line.a * infinite.d;
  to.w = e.line.a * infinite.b - e.line.b * infinite.a;
  to.tolerance = 4 * determinant_error;
  const Vec3 direction = to.h * axes_.a + to.t * axes_.b + to.w * axes_.d;
  int sign = glm::dot(cone.camera.forward, direction) > 0 ? -1 : 1;
  to.h *= sign, to.t *= sign, to.w *= sign;
  to.plane1 = e.plane;
  to.plane2 = chart_.problem->infinity();
  to.sign = static_cast<std::int8_t>(sign * e.orientation);
  to.apex = false;
  bool inside = cone.complement;
  for (std::uint32_t k = 0; k < cone.size(); ++k) {
    const Line line = line_of(cone.normals[k], axes_);
    const int s0 = chart_.side(from, base_ + k, line), s1 = chart_.side(to, base_ + k, line);
    if (s0 == s1) continue;
    const std::uint32_t before = cone.previous[k], after = cone.next[k];
    // to = sign (e x infinity) and k's line has the sign s1 there, so det(e, k, infinity) has the
    // sign of -s1 sign; x = s (e x k) is on infinity's positive side.
    const int s = -s1 * sign;
    Corner x{};
    x.h = s * (e.line.b * line.d - e.line.d * line.b);
    x.t = s * (e.line.d * line.a - e.line.a * line.d);
    x.w = s * (e.line.a * line.b - e.line.b * line.a);
    x.tolerance = determinant_error;
    x.plane1 = e.plane, x.plane2 = base_ + k;
    x.sign = static_cast<std::int8_t>(s * e.orientation);
    x.apex = false;
    if (chart_.side(x, base_ + before, line_of(cone.normals[before], axes_)) == cone.turn[k] &&
        chart_.side(x, base_ + after, line_of(cone.normals[after], axes_)) == cone.turn[after])
      inside = !inside;
  }
  return inside;
}

}  // namespace polyhull::hull
