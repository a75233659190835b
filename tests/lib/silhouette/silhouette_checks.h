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

#include "base/rings.h"
#include "silhouette/contour/trace.h"
#include "silhouette/pixels/matte.h"
#include "support/ring_checks.h"

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

/// The matte under a Gaussian in double precision, cut at 8 sigma, border values continued; row by
/// row.
inline std::vector<double> exact_blur(const Matte& m, double sigma) {
  const int reach = static_cast<int>(std::ceil(8.0 * sigma)) + 1;
  std::vector<double> kernel;
  double total = 0.0;
  for (int k = -reach; k <= reach; ++k)
    total += kernel.emplace_back(std::exp(-0.5 * k * k / (sigma * sigma)));
  for (double& k : kernel) k /= total;
  const int w = m.width, h = m.height;
  std::vector<double> columns(static_cast<std::size_t>(w) * h), out(columns.size());
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      double sum = 0.0;
      for (int k = -reach; k <= reach; ++k)
        sum += kernel[k + reach] * m.row(std::clamp(y + k, 0, h - 1))[x];
      columns[static_cast<std::size_t>(y) * w + x] = sum;
    }
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      double sum = 0.0;
      for (int k = -reach; k <= reach; ++k)
        sum += kernel[k + reach] *
               columns[static_cast<std::size_t>(y) * w + std::clamp(x + k, 0, w - 1)];
      out[static_cast<std::size_t>(y) * w + x] = sum;
    }
  return out;
}

/// Every ring has at least three corners, none twice in a row, and no two edges meet.
inline ::testing::AssertionResult simple_and_disjoint(const Rings& rings) {
  const std::string fault = meeting_edges(rings);
  return fault.empty() ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << fault;
}

/// Outer rings lie inside an even number of others, holes inside an odd number.
inline ::testing::AssertionResult well_nested(const Rings& rings) {
  const std::string fault = nesting_fault(rings);
  return fault.empty() ? ::testing::AssertionSuccess() : ::testing::AssertionFailure() << fault;
}

}  // namespace polyhull::test
