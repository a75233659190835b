// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/lens/monotone_cubic.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

/// Of Fritsch and Butland: the slope at a knot between two pieces of the widths \p before and \p after.
double slope_between(double before, double after, double slope_before, double slope_after) {
  if (slope_before * slope_after <= 0.0) return 0.0;
  const double a = 2.0 * after + before, b = after + 2.0 * before;
  return (a + b) / (a / slope_before + b / slope_after);
}

/// The slope at an end: that of the parabola through three knots, as far as it stays monotone.
double slope_at_end(double first, double second, double slope, double next_slope) {
  const double end = ((2.0 * first + second) * slope - first * next_slope) / (first + second);
  if (end * slope <= 0.0) return 0.0;
  if (slope * next_slope <= 0.0 && std::abs(end) > 3.0 * std::abs(slope)) return 3.0 * slope;
  return end;
}

}  // namespace

double monotone_cubic(const std::vector<double>& xs, const std::vector<double>& ys, double x) {
  if (x <= xs.front()) return ys.front();
  if (x >= xs.back()) return ys.back();
  const auto i = static_cast<std::size_t>(std::upper_bound(xs.begin(), xs.end(), x) - xs.begin());
  const auto width = [&](std::size_t k) { return xs[k] - xs[k - 1]; };
  const auto slope = [&](std::size_t k) { return (ys[k] - ys[k - 1]) / width(k); };
  const std::size_t last = xs.size() - 1;
  const double h = width(i), m = slope(i);
  // Two points make a straight line.
  const double before = i > 1      ? slope_between(width(i - 1), h, slope(i - 1), m)
                        : i < last ? slope_at_end(h, width(i + 1), m, slope(i + 1))
                                   : m;
  const double after = i < last ? slope_between(h, width(i + 1), m, slope(i + 1))
                       : i > 1  ? slope_at_end(h, width(i - 1), m, slope(i - 1))
                                : m;
  const double t = (x - xs[i - 1]) / h;
  const double value =
      ys[i - 1] +
      h * t * (before + t * (3.0 * m - 2.0 * before - after + t * (before + after - 2.0 * m)));
  return std::clamp(value, std::min(ys[i - 1], ys[i]), std::max(ys[i - 1], ys[i]));
}

}  // namespace polyhull
