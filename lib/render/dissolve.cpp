// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/dissolve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

namespace polyhull {

void dissolve(std::uint8_t* picture, int stride, const std::uint8_t* other, int other_stride,
              int width, int height, float share, AlphaCoding alpha) {
  constexpr std::uint32_t one = 1 << 16;
  const auto own = static_cast<std::uint32_t>(std::lround(share * static_cast<float>(one)));
  const auto mixed = [&](std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint8_t>((own * a + (one - own) * b + one / 2) / one);
  };
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = picture + static_cast<std::ptrdiff_t>(y) * stride;
    const std::uint8_t* from = other + static_cast<std::ptrdiff_t>(y) * other_stride;
    for (int x = 0; x < width; ++x, row += 4, from += 4) {
      if (std::memcmp(row, from, 4) == 0) continue;
      if (alpha == AlphaCoding::straight && row[3] != from[3]) {
        const std::uint64_t a = std::uint64_t{own} * row[3];
        const std::uint64_t b = std::uint64_t{one - own} * from[3];
        const std::uint64_t both = std::max(a + b, std::uint64_t{1});
        for (int c = 0; c < 3; ++c)
          row[c] = static_cast<std::uint8_t>((a * row[c] + b * from[c] + both / 2) / both);
      } else {
        for (int c = 0; c < 3; ++c) row[c] = mixed(row[c], from[c]);
      }
      row[3] = mixed(row[3], from[3]);
    }
  }
}

}  // namespace polyhull
