// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/blur/blur.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "silhouette_checks.h"

namespace polyhull {
namespace {

double largest_error(const Matte& m, BlurMethod method, double sigma, int passes = 3) {
  Blur blur;
  BlurSettings settings;
  settings.method = method;
  settings.sigma = sigma;
  settings.passes = passes;
  blur.set(settings);
  Field field;
  blur.apply(m, field);
  const std::vector<double> truth =
      sigma > 0.0 ? test::exact_blur(m, sigma) : std::vector<double>();
  double most = 0.0;
  for (int y = 0; y < m.height; ++y)
    for (int x = 0; x < m.width; ++x) {
      const double want =
          sigma > 0.0 ? truth[static_cast<std::size_t>(y) * m.width + x] : m.row(y)[x];
      most = std::max(most, std::abs(field.row(y)[x] / static_cast<double>(field_scale) - want));
      const BlockState state = field.state_row(y)[x / matte_block];
      if (state == block_empty) {
        EXPECT_EQ(field.row(y)[x], 0);
      }
      if (state == block_full) {
        EXPECT_EQ(field.row(y)[x], field_full);
      }
    }
  return most;
}

// A figure of limbs, holes and a cut edge, with soft and hard boundaries.
Matte figure(int width, int height) {
  std::mt19937 random(1);
  return test::draw(width, height, [&](int x, int y) {
    const double u = static_cast<double>(x) / width, v = static_cast<double>(y) / height;
    const double body = 0.18 - std::hypot(u - 0.5, (v - 0.5) * 0.5);
    const double arm = 0.03 - std::abs(v - 0.3 - 0.4 * std::abs(u - 0.5));
    const double hole = std::hypot(u - 0.5, v - 0.45) - 0.04;
    const double d =
        std::min(std::max(body, std::min(arm, 0.45 - std::abs(u - 0.5))), hole) * width;
    if (x < width / 6 && y > height * 3 / 4) return (x / 3 + y / 5) % 2 ? 255 : 0;
    return static_cast<int>(std::clamp(127.5 + 255.0 * d, 0.0, 255.0));
  });
}

TEST(Blur, ErrorAgainstDoublePrecision) {
  const Matte m = figure(400, 300);
  std::printf("largest error in levels\n%8s %8s %8s %8s\n", "sigma", "fir", "box", "recursive");
  for (const double sigma : {0.3, 0.5, 0.8, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 100.0}) {
    const double fir = largest_error(m, BlurMethod::fir, sigma);
    const double box = largest_error(m, BlurMethod::box, sigma);
    const double recursive = largest_error(m, BlurMethod::recursive, sigma);
    std::printf("%8g %8.3f %8.3f %8.3f\n", sigma, fir, box, recursive);
    EXPECT_LE(fir, sigma <= 8.0 ? 0.15 : 0.5) << sigma;
    EXPECT_LE(recursive, 0.5) << sigma;
    if (sigma >= 1.0) {
      EXPECT_LE(box, 8.0) << sigma;
    }
  }
}

TEST(Blur, EverySizeAndPlace) {
  std::mt19937 random(5);
  for (int round = 0; round < 80; ++round) {
    const int w = 1 + static_cast<int>(random() % 90), h = 1 + static_cast<int>(random() % 50);
    const double sigma = std::array{0.4, 1.0, 2.0, 3.7, 12.0}[random() % 5];
    const int kind = static_cast<int>(random() % 4);
    const int bx = static_cast<int>(random() % 90), by = static_cast<int>(random() % 50);
    const Matte m = test::draw(w, h, [&](int x, int y) {
      if (kind == 0) return x >= bx && y >= by ? 255 : 0;
      if (kind == 1) return x == bx % w && y == by % h ? 255 : 0;
      if (kind == 2) return static_cast<int>(random() % 256);
      return x / 16 % 2 ? 255 : 0;  // uniform blocks side by side
    });
    EXPECT_LE(largest_error(m, BlurMethod::fir, sigma), 0.3)
        << w << "x" << h << " sigma " << sigma << " kind " << kind;
    EXPECT_LE(largest_error(m, BlurMethod::recursive, sigma), 0.5)
        << w << "x" << h << " sigma " << sigma;
  }
}

TEST(Blur, NoBlurKeepsTheMatte) {
  const Matte m = figure(61, 45);
  for (const BlurMethod method : {BlurMethod::fir, BlurMethod::box, BlurMethod::recursive})
    EXPECT_EQ(largest_error(m, method, 0.0), 0.0);
}

TEST(Blur, SkippingUniformBlocksChangesNothing) {
  Matte m = figure(333, 120);
  Blur blur;
  BlurSettings settings;
  settings.sigma = 3.0;
  blur.set(settings);
  Field with, without;
  blur.apply(m, with);
  std::fill(m.states.begin(), m.states.end(), block_mixed);
  blur.apply(m, without);
  EXPECT_EQ(with.values, without.values);
}

TEST(Blur, ThresholdMakesTheMatteBinary) {
  const Matte m = figure(100, 80);
  Blur blur;
  BlurSettings settings;
  settings.threshold = 100;
  blur.set(settings);
  Field field;
  blur.apply(m, field);
  const std::vector<double> truth = test::exact_blur(m, settings.sigma);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 100; ++x) {
      const double want = truth[static_cast<std::size_t>(y) * 100 + x];
      if (std::abs(want - 99.5) < 0.2) continue;
      EXPECT_EQ(field.row(y)[x], want > 99.5 ? field_full : 0);
    }
}

TEST(Blur, ThresholdHasItsOwnRow) {
  // Rounding to 8 bit, with and without threshold, into every fourth byte.
  const std::int16_t row[4] = {0, 63, 64, field_full};
  std::uint8_t out[16] = {};
  store_field_row(row, 4, 0, out + 3, 4);
  EXPECT_EQ(out[3], 0);
  EXPECT_EQ(out[7], 0);
  EXPECT_EQ(out[11], 1);
  EXPECT_EQ(out[15], 255);
}

TEST(Blur, RefusesNonsense) {
  Blur blur;
  BlurSettings settings;
  for (const double sigma : {-1.0, 101.0, std::nan("")}) {
    settings.sigma = sigma;
    EXPECT_THROW(blur.set(settings), Error);
  }
}

}  // namespace
}  // namespace polyhull
