// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raster/covered_blocks.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace polyhull {
namespace {

/// draw_packed() rounds columns to single precision, below a thousandth of a pixel on the largest
/// screens: so far inside an edge, or outside, there is no doubt.
constexpr double edge_doubt = 1.0 / 64;
/// It rounds 1/z four times, each by up to 2^-24 of the largest value up to 64 pixels to the left.
constexpr double depth_doubt = 1e-6;

struct Range {
  double low, high;
};

/// Of k x for x within \p at.
Range times(double k, const Range& at) {
  return k < 0.0 ? Range{k * at.high, k * at.low} : Range{k * at.low, k * at.high};
}

Range sum(const Range& a, const Range& b) {
  return {a.low + b.low, a.high + b.high};
}

Range columns_of(int left, int right, int block) {
  const double begin = left + block * CoveredBlocks::width;
  return {begin, std::min<double>(begin + CoveredBlocks::width, right)};
}

/// How far inside an edge of a triangle a point of some rows lies, pixels: dx x + rows.
struct Edge {
  double dx;
  Range rows;
};

/// The edge between corners \p i and \p j of \p t.
Edge edge_of(const ScreenTriangle& t, int i, int j, const Range& rows) {
  const double x = t.x[j] - t.x[i], y = t.y[j] - t.y[i];
  const int k = 3 - i - j;
  const double inside = (t.x[k] - t.x[i]) * y - (t.y[k] - t.y[i]) * x;
  const double scale = (inside < 0.0 ? -1.0 : 1.0) / std::sqrt(x * x + y * y);
  const double start = (t.y[i] * x - t.x[i] * y) * scale;
  return {y * scale, sum({start, start}, times(-x * scale, rows))};
}

/// How far inside all of a triangle's edges the places of a block lie.
struct Edges {
  Edge edges[3];

  Edges(const ScreenTriangle& t, const Range& rows)
      : edges{edge_of(t, 0, 1, rows), edge_of(t, 1, 2, rows), edge_of(t, 0, 2, rows)} {}
  Range within(const Range& columns) const {
    Range least{1e30, 1e30};
    for (const Edge& edge : edges) {
      const Range inside = sum(times(edge.dx, columns), edge.rows);
      least = {std::min(least.low, inside.low), std::min(least.high, inside.high)};
    }
    return least;
  }
};

/// The values of \p plane in a block.
Range exact_values(const ScreenPlane& plane, const Range& columns, const Range& rows) {
  return sum({plane.value, plane.value}, sum(times(plane.dx, columns), times(plane.dy, rows)));
}

/// By how much draw_packed() may have them otherwise.
double doubt_of(const ScreenPlane& plane, const Range& columns, const Range& rows) {
  const Range at = exact_values(plane, columns, rows);
  return depth_doubt * (std::max(std::abs(at.low), std::abs(at.high)) + 66.0 * std::abs(plane.dx) +
                        std::abs(plane.dy));
}

/// Whether plane \p a is nearer than plane \p b everywhere in a block, however they are rounded.
bool is_before(const ScreenPlane& a, const ScreenPlane& b, const Range& columns,
               const Range& rows) {
  const ScreenPlane between{a.value - b.value, a.dx - b.dx, a.dy - b.dy};
  return exact_values(between, columns, rows).low >
         doubt_of(a, columns, rows) + doubt_of(b, columns, rows);
}

/// The largest 1/z that draw_packed() may find on a triangle's face, or a rounded column beside it.
double nearest_of(const ScreenTriangle& t) {
  constexpr double beside = 1.0 / 512;
  const ScreenPlane& at = t.inverse;
  double most = 0.0;
  for (int i = 0; i < 3; ++i) most = std::max(most, at.value + t.x[i] * at.dx + t.y[i] * at.dy);
  return most * (1.0 + depth_doubt) +
         (beside + 66.0 * depth_doubt) * (std::abs(at.dx) + std::abs(at.dy));
}

}  // namespace

void CoveredBlocks::begin(int left, int right, int top, int bottom) {
  left_ = left;
  right_ = right;
  top_ = top;
  bottom_ = bottom;
  blocks_.assign(static_cast<std::size_t>((right - left + width - 1) / width), {});
  shown_.clear();
}

/// The first and the last block that \p t may touch; the last one less than the first: none.
std::pair<int, int> CoveredBlocks::touched(const ScreenTriangle& t) const {
  const auto [low, high] = std::minmax({t.x[0], t.x[1], t.x[2]});
  if (!(high + edge_doubt >= left_ && low - edge_doubt <= right_)) return {0, -1};
  return {(static_cast<int>(std::max<double>(low - edge_doubt, left_)) - left_) / width,
          (static_cast<int>(std::min<double>(high + edge_doubt, right_ - 1)) - left_) / width};
}

void CoveredBlocks::cover(const ScreenTriangle& t, std::uint32_t number) {
  const Range rows{static_cast<double>(top_), static_cast<double>(bottom_)};
  if (!(t.y[0] < rows.low && t.y[2] > rows.high)) return;
  const auto [first, last] = touched(t);
  // What covers a block reaches into those beside it, but for the band's ends.
  if (last - first < 2 && first > 0 && last + 1 < static_cast<int>(blocks_.size())) return;
  const Edges edges(t, rows);
  for (int i = first; i <= last; ++i) {
    const Range columns = columns_of(left_, right_, i);
    if (!(edges.within(columns).low > edge_doubt)) continue;
    const double farthest =
        exact_values(t.inverse, columns, rows).low - doubt_of(t.inverse, columns, rows);
    Block& block = blocks_[static_cast<std::size_t>(i)];
    if (farthest > block.farthest) block = {number, false, farthest, t.inverse};
  }
}

void CoveredBlocks::show(const ScreenTriangle& t, std::uint32_t number) {
  const Range rows{static_cast<double>(top_), static_cast<double>(bottom_)};
  const auto [first, last] = touched(t);
  if (first > last) return;
  Shown shown{number, last + 1, first};
  const double nearest = nearest_of(t);
  // Where few blocks are touched, they are taken for granted.
  const std::optional<Edges> edges =
      last - first > 2 ? std::optional(Edges(t, rows)) : std::nullopt;
  for (int i = first; i <= last; ++i) {
    Block& block = blocks_[static_cast<std::size_t>(i)];
    if (block.number != number) {
      if (nearest < block.farthest) continue;
      const Range columns = columns_of(left_, right_, i);
      if (edges && edges->within(columns).high < -edge_doubt) continue;
      if (block.number != no_triangle && is_before(block.inverse, t.inverse, columns, rows))
        continue;
      block.others = true;
    }
    shown.first = std::min(shown.first, i);
    shown.last = i;
  }
  if (shown.first <= shown.last) shown_.push_back(shown);
}

}  // namespace polyhull
