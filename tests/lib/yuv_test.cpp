// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/yuv.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace polyhull {
namespace {

struct Case {
  double kr, kb;
  bool full_range, left_sited, half_height;
  int width, height;
};

class Yuv : public testing::TestWithParam<Case> {};

std::vector<std::uint8_t> picture(int width, int height) {
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width) * height * 4);
  std::uint32_t state = 12345;
  for (std::size_t i = 0; i < rgba.size(); ++i) {
    state = state * 1664525u + 1013904223u;
    // Noise in one half, saturated patches in the other.
    rgba[i] =
        static_cast<std::uint8_t>(i % (4 * width) < 2u * width ? state >> 24 : (state >> 31) * 255);
  }
  return rgba;
}

TEST_P(Yuv, MatchesTheFormulaInDoublePrecision) {
  const Case c = GetParam();
  const auto rgba = picture(c.width, c.height);
  const int cw = (c.width + 1) / 2, ch = c.half_height ? (c.height + 1) / 2 : c.height;
  std::vector<std::uint8_t> y(c.width * c.height), cb(cw * ch), cr(cw * ch);
  YuvTarget target;
  target.y = y.data();
  target.y_stride = c.width;
  target.cb = cb.data();
  target.cr = cr.data();
  target.chroma_stride = cw;
  target.half_height = c.half_height;
  rgba_to_yuv(rgba.data(), 4 * c.width, c.width, c.height, {c.kr, c.kb, c.full_range, c.left_sited},
              target);

  const double ys = c.full_range ? 1.0 : 219.0 / 255.0, cs = c.full_range ? 1.0 : 224.0 / 255.0;
  const auto at = [&](int x, int row, int k) {
    x = std::clamp(x, 0, c.width - 1);
    return static_cast<double>(
        rgba[(static_cast<std::size_t>(std::min(row, c.height - 1)) * c.width + x) * 4 + k]);
  };
  const auto luma = [&](double r, double g, double b) {
    return c.kr * r + (1.0 - c.kr - c.kb) * g + c.kb * b;
  };
  for (int j = 0; j < c.height; ++j) {
    for (int i = 0; i < c.width; ++i) {
      const double expected =
          (c.full_range ? 0 : 16) + ys * luma(at(i, j, 0), at(i, j, 1), at(i, j, 2));
      ASSERT_NEAR(y[j * c.width + i], expected, 0.52);
    }
  }
  const int rows = c.half_height ? 2 : 1;
  for (int j = 0; j < ch; ++j) {
    for (int i = 0; i < cw; ++i) {
      double rgb[3] = {};
      for (int k = 0; k < 3; ++k) {
        for (int r = 0; r < rows; ++r) {
          const int row = j * rows + r, x = 2 * i;
          const double mean = c.left_sited
                                  ? (at(x - 1, row, k) + 2 * at(x, row, k) + at(x + 1, row, k)) / 4
                                  : (at(x, row, k) + at(x + 1, row, k)) / 2;
          rgb[k] += mean / rows;
        }
      }
      const double l = luma(rgb[0], rgb[1], rgb[2]);
      const double eb = 128 + cs * (rgb[2] - l) / (2 * (1 - c.kb)),
                   er = 128 + cs * (rgb[0] - l) / (2 * (1 - c.kr));
      ASSERT_NEAR(cb[j * cw + i], std::clamp(eb, 0.0, 255.0), 0.52);
      ASSERT_NEAR(cr[j * cw + i], std::clamp(er, 0.0, 255.0), 0.52);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Codings, Yuv,
                         testing::Values(Case{0.299, 0.114, false, false, true, 64, 48},
                                         Case{0.2126, 0.0722, false, true, true, 64, 48},
                                         Case{0.299, 0.114, true, false, false, 64, 48},
                                         Case{0.2126, 0.0722, true, true, false, 63, 47},
                                         Case{0.299, 0.114, false, true, true, 63, 47},
                                         Case{0.2126, 0.0722, false, false, true, 1, 1}));

}  // namespace
}  // namespace polyhull
