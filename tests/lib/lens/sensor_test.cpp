// SPDX-License-Identifier: LGPL-2.1-or-later
// Fall-off against its formula; grain's statistics.
#include "render/lens/sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/srgb.h"
#include "scene/scene.h"

namespace polyhull {
namespace {

using Pixels = std::vector<std::uint8_t>;

constexpr int width = 701, height = 397;  // no multiples of anything

Camera viewport() {
  Camera camera = look_at({0, 1, 4}, {0, 1, 0}, 50.0, width, height);
  camera.K[2][0] += 31.0;  // off the middle
  return camera;
}

Pixels even(std::uint8_t value) {
  return Pixels(4 * static_cast<std::size_t>(width) * height, value);
}

Pixels grained(double grain, double size, std::uint64_t frame, std::uint8_t value = 128) {
  Sensor sensor;
  ViewportLens lens;
  lens.grain = grain;
  lens.grain_size = size;
  Pixels pixels = even(value);
  sensor.finish(lens, viewport(), frame, pixels.data(), 4 * width);
  return pixels;
}

/// Of a channel's differences from 128 and those of another picture's (or its own) \p right pixels
/// to the right: mean of the product.
double product(const Pixels& a, std::size_t channel_a, const Pixels& b, std::size_t channel_b,
               int right) {
  double sum = 0.0;
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x + static_cast<std::size_t>(right) < width; ++x)
      sum += (a[4 * (y * width + x) + channel_a] - 128.0) *
             (b[4 * (y * width + x + static_cast<std::size_t>(right)) + channel_b] - 128.0);
  return sum / (static_cast<double>(height) * (width - right));
}

TEST(Sensor, IsIdleByDefault) {
  EXPECT_FALSE(Sensor::wanted({}));
  Pixels pixels = grained(0.0, 3.0, 1, 77);
  EXPECT_EQ(pixels, even(77));
}

TEST(Sensor, FallsOffByItsFormula) {
  Sensor sensor;
  ViewportLens lens;
  lens.falloff = {-1.84, 1.81, -0.73};
  const Camera camera = viewport();
  Pixels pixels = even(200);
  for (std::size_t i = 3; i < pixels.size(); i += 4) pixels[i] = 9;
  sensor.finish(lens, camera, 0, pixels.data(), 4 * width);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = (x - camera.K[2][0]) / camera.K[0][0];
      const double v = (y - camera.K[2][1]) / camera.K[1][1];
      const double s = u * u + v * v;
      const double gain = 1.0 + s * (-1.84 + s * (1.81 + s * -0.73));
      const double code = 255.0 * srgb_encoded(gain * srgb_decoded(200.0 / 255.0));
      const std::uint8_t* pixel =
          &pixels[4 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x))];
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(pixel[c], code, 0.6) << x << " " << y;
      ASSERT_EQ(pixel[3], 9);
      // And cos^4 is what the coefficients stand for.
      ASSERT_NEAR(gain, 1.0 / ((1.0 + s) * (1.0 + s)), s < 1.0 ? 0.011 : 0.1);
    }
}

TEST(Sensor, LightNeverGetsBelowNothing) {
  Sensor sensor;
  ViewportLens lens;
  lens.falloff = {-50.0, 0.0, 0.0};
  Pixels pixels = even(255);
  sensor.finish(lens, viewport(), 0, pixels.data(), 4 * width);
  EXPECT_EQ(pixels[0], 0);
  lens.falloff = {50.0, 0.0, 0.0};
  pixels = even(255);
  sensor.finish(lens, viewport(), 0, pixels.data(), 4 * width);
  EXPECT_EQ(pixels[0], 255);
}

TEST(Sensor, GrainHasItsStatistics) {
  for (const double size : {1.0, 2.0, 4.0}) {
    const Pixels pixels = grained(0.05, size, 7);
    for (std::size_t c = 0; c < 3; ++c) {
      double mean = 0.0;
      for (std::size_t i = c; i < pixels.size(); i += 4) mean += pixels[i] - 128.0;
      mean /= static_cast<double>(width) * height;
      // Grains are independent samples, so the wider, the fewer.
      EXPECT_NEAR(mean, 0.0, 0.15 * size) << size;
      const double variance = product(pixels, c, pixels, c, 0);
      EXPECT_NEAR(std::sqrt(variance), 0.05 * 255.0, 0.04 * 0.05 * 255.0) << size;
      // The width at half of the autocorrelation's height: exp(-4 ln 2 (x / size)^2), but that the
      // narrowest grains' weights are few.
      for (const int right : {1, 2, 3, 6})
        EXPECT_NEAR(product(pixels, c, pixels, c, right) / variance,
                    std::exp(-4.0 * std::log(2.0) * right * right / (size * size)),
                    size < 3.0 ? 0.07 : 0.04)
            << size << " " << right;
    }
    EXPECT_LT(std::abs(product(pixels, 0, pixels, 1, 0)), 0.05 * 162.0 * size);
    EXPECT_LT(std::abs(product(pixels, 1, pixels, 2, 0)), 0.05 * 162.0 * size);
  }
}

TEST(Sensor, GrainIsTheFramesOwn) {
  const Pixels first = grained(0.05, 1.5, 40'000'000), again = grained(0.05, 1.5, 40'000'000);
  EXPECT_EQ(first, again);
  for (const std::uint64_t frame : {0u, 1u, 80'000'000u, 120'000'000u}) {
    const Pixels other = grained(0.05, 1.5, frame);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_LT(std::abs(product(first, c, other, c, 0)), 0.08 * 162.0) << frame;
  }
}

TEST(Sensor, GrainLeavesAlphaAndKeepsWithinCodes) {
  Pixels pixels = grained(1.0, 1.0, 3);
  for (std::size_t i = 3; i < pixels.size(); i += 4) ASSERT_EQ(pixels[i], 128);
  // A sixth of a Gaussian lies a standard deviation above its mean.
  double black = 0.0;
  for (std::size_t i = 0; i < pixels.size(); i += 4) black += pixels[i] == 0;
  EXPECT_NEAR(black / (static_cast<double>(width) * height), 0.308, 0.02);
}

// Grain of a size is the same whatever size was before it.
TEST(Sensor, SizesMayChange) {
  Sensor sensor;
  ViewportLens lens;
  lens.grain = 0.05;
  for (const double size : {1.0, 6.0, 2.5, 1.0}) {
    lens.grain_size = size;
    Pixels pixels = even(128);
    sensor.finish(lens, viewport(), 3, pixels.data(), 4 * width);
    EXPECT_EQ(pixels, grained(0.05, size, 3)) << size;
  }
}

}  // namespace
}  // namespace polyhull
