// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far two pictures differ.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"

namespace polyhull::synthetic {

/// Peak signal-to-noise ratio in dB, of red, green and blue over the pixels that \p counts accepts; 99
/// where they are alike, 0 where none counts.
template <typename Counts>
double psnr(const Picture& a, const Picture& b, Counts counts) {
  double sum = 0.0, n = 0.0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      if (!counts(x, y)) continue;
      for (int c = 0; c < 3; ++c) {
        const double d =
            double(a.row(y)[a.channels * x + c]) - double(b.row(y)[b.channels * x + c]);
        sum += d * d;
        n += 1.0;
      }
    }
  }
  return n == 0.0 ? 0.0 : sum == 0.0 ? 99.0 : 10.0 * std::log10(255.0 * 255.0 * n / sum);
}

/// The same over all pixels.
inline double psnr(const Picture& a, const Picture& b) {
  return psnr(a, b, [](int, int) { return true; });
}

/// Root mean square of the channels' differences.
inline double rms(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3f d = a[i] - b[i];
    sum += glm::dot(d, d) / 3.0;
  }
  return std::sqrt(sum / static_cast<double>(a.size()));
}

/// The channels' largest difference.
inline float furthest(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
  float most = 0.0f;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int k = 0; k < 3; ++k) most = std::max(most, std::abs(a[i][k] - b[i][k]));
  return most;
}

}  // namespace polyhull::synthetic
