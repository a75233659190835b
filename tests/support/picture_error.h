// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far two pictures differ.
#pragma once

#include <cmath>

#include "base/picture.h"

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

}  // namespace polyhull::synthetic
