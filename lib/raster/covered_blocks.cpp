// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raster/covered_blocks.h"

#include <algorithm>
#include <cmath>

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
  const double scale = (inside < 0.0 ? -1.0 : 1.0) / std::hypot(x, y);
  const double start = (t.y[i] * x - t.x[i] * y) * scale;
  return {y * scale, sum({start, start}, times(-x * scale, rows))};
}

/// The largest 1/z on a triangle's face.
double nearest_of(const ScreenTriangle& t) {
  double most = 0.0;
  for (int i = 0; i < 3; ++i)
    most = std::max(most, t.inverse.value + t.x[i] * t.inverse.dx + t.y[i] * t.inverse.dy);
  return most;
}

}  // namespace

void CoveredBlocks::begin(int left, int right, int top, int bottom) {
  left_ = left;
  right_ = right;
  top_ = top;
  bottom_ = bottom;
  blocks_.assign(static_cast<std::size_t>((right - left + width - 1) / width), {});
}

void CoveredBlocks::add(const ScreenTriangle& t, std::uint32_t number) {
  const auto [low, high] = std::minmax({t.x[0], t.x[1], t.x[2]});
  if (high < left_ - 1 || low > right_ + 1) return;
  const int first = (static_cast<int>(std::max<double>(low - 1.0, left_)) - left_) / width;
  const int last = (static_cast<int>(std::min<double>(high + 1.0, right_ - 1)) - left_) / width;
  const Range rows{static_cast<double>(top_), static_cast<double>(bottom_)};
  const Edge edges[3] = {edge_of(t, 0, 1, rows), edge_of(t, 1, 2, rows), edge_of(t, 0, 2, rows)};
  const Range down = times(t.inverse.dy, rows);
  const double most = nearest_of(t);
  for (int i = first; i <= last; ++i) {
    const double begin = left_ + i * width;
    const Range columns{begin, std::min<double>(begin + width, right_)};
    bool within = true, beside = false;
    for (const Edge& edge : edges) {
      const Range inside = sum(times(edge.dx, columns), edge.rows);
      within = within && inside.low > edge_doubt;
      beside = beside || inside.high < -edge_doubt;
    }
    if (beside) continue;
    Range depth = sum(times(t.inverse.dx, columns), down);
    depth = {depth.low + t.inverse.value, depth.high + t.inverse.value};
    const double doubt = depth_doubt * (std::max(std::abs(depth.low), std::abs(depth.high)) +
                                        66.0 * std::abs(t.inverse.dx) + std::abs(t.inverse.dy));
    depth = {depth.low - doubt, std::min(depth.high, most) + doubt};
    Block& block = blocks_[static_cast<std::size_t>(i)];
    if (!within || !(depth.low > block.farthest)) {
      block.others = std::max(block.others, depth.high);
      continue;
    }
    block = {depth.low, depth.high, std::max(block.others, block.nearest), number};
  }
}

}  // namespace polyhull
