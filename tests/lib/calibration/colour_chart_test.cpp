// SPDX-License-Identifier: LGPL-2.1-or-later
// Charts in the pictures of cameras with gains, crosstalk and noise of their own.
#include "studio/calibration/colour_chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/colour_difference.h"
#include "base/error.h"
#include "base/srgb.h"

namespace polyhull {
namespace {

constexpr int width = 320, height = 240;
const std::array<Vec2, 4> corners{Vec2{30, 20}, {290, 40}, {280, 215}, {45, 200}};

Mat3 random_response(std::mt19937& random) {
  std::uniform_real_distribution<double> gain(0.8, 1.25), crosstalk(-0.03, 0.03);
  Mat3 response(0.0);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) response[column][row] = crosstalk(random);
  for (int c = 0; c < 3; ++c) response[c][c] += 1.0;
  return Mat3(gain(random)) * response;
}

// The patch at pixel \p p, or -1.
int patch_at(const Vec2& p) {
  for (int patch = 0; patch < chart_patches; ++patch) {
    const Vec2 low(patch % chart_columns / 6.0, patch / chart_columns / 4.0);
    std::array<Vec2, 4> corner;
    for (int i = 0; i < 4; ++i) {
      const double u = low.x + (i == 1 || i == 2) / 6.0, v = low.y + (i >= 2) / 4.0;
      // Straight lines stay straight and the patches' middles stay within: a bilinear figure is
      // near enough to the perspective one for corners as these.
      corner[i] = (1 - v) * ((1 - u) * corners[0] + u * corners[1]) +
                  v * ((1 - u) * corners[3] + u * corners[2]);
    }
    bool within = true;
    for (int i = 0; i < 4; ++i)
      within = within && cross(corner[(i + 1) % 4] - corner[i], p - corner[i]) >= 0.0;
    if (within) return patch;
  }
  return -1;
}

Picture picture_of_chart(const Mat3& response, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 1.5);
  Picture picture{width, height, 3, std::vector<std::uint8_t>(width * height * 3, 20)};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int patch = patch_at(Vec2(x, y));
      if (patch < 0) continue;
      const Vec3 linear = response * published_chart()[patch];
      for (int c = 0; c < 3; ++c) {
        const double code = 255.0 * srgb_encoded(std::max(linear[c], 0.0)) + noise(random);
        picture.row(y)[3 * x + c] =
            static_cast<std::uint8_t>(std::clamp(std::lround(code), 0L, 255L));
      }
    }
  return picture;
}

TEST(ColourChart, CamerasAgreeAfterTheirMatrices) {
  std::mt19937 random(7);
  double worst_before = 0.0, worst_after = 0.0, sum_after = 0.0;
  int count = 0;
  for (int round = 0; round < 20; ++round) {
    const ChartColours seen =
        read_chart(picture_of_chart(random_response(random), random), corners, "cam0");
    std::vector<Vec3> from, to;
    for (int patch = 0; patch < chart_patches; ++patch)
      if (!seen.clipped[patch]) {
        from.push_back(seen.linear[patch]);
        to.push_back(published_chart()[patch]);
      }
    ASSERT_GE(from.size(), 18u);
    const Mat3 matrix = colour_matrix(from, to);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const Vec3 wanted = lab_of_linear(to[i]);
      const double after = colour_difference(lab_of_linear(matrix * from[i]), wanted);
      worst_before = std::max(worst_before, colour_difference(lab_of_linear(from[i]), wanted));
      worst_after = std::max(worst_after, after);
      sum_after += after;
      ++count;
    }
  }
  RecordProperty("worst_before", std::to_string(worst_before));
  RecordProperty("worst_after", std::to_string(worst_after));
  RecordProperty("mean_after", std::to_string(sum_after / count));
  EXPECT_GT(worst_before, 5.0);
  EXPECT_LE(worst_after, 1.0);
}

TEST(ColourChart, OneColourSaysTheGainOnly) {
  const std::vector<Vec3> seen{Vec3(0.2)}, wanted{Vec3(0.25)};
  const Mat3 matrix = colour_matrix(seen, wanted);
  EXPECT_NEAR(matrix[0][0], 1.25, 1e-6);
  EXPECT_NEAR(matrix[1][0], 0.0, 1e-6);
  EXPECT_EQ(colour_matrix({}, {}), Mat3(1.0));
}

TEST(ColourChart, ClippedPatchesAreFound) {
  std::mt19937 random(3);
  const ChartColours seen = read_chart(picture_of_chart(Mat3(1.3), random), corners, "cam0");
  EXPECT_TRUE(seen.clipped[18]);   // white
  EXPECT_FALSE(seen.clipped[21]);  // neutral 5
}

TEST(GreyCard, ItsLightAndWhatCannotBeRead) {
  Picture picture{width, height, 3, std::vector<std::uint8_t>(width * height * 3, 128)};
  for (std::size_t i = 0; i < picture.pixels.size(); i += 3) picture.pixels[i] = 100;
  const Vec3 light = read_card(picture, {20, 90}, {80, 30}, "cam0");
  EXPECT_NEAR(light.r, srgb_to_linear(100), 1e-6);
  EXPECT_NEAR(light.g, srgb_to_linear(128), 1e-6);
  EXPECT_THROW(read_card(picture, {20, 30}, {width, 90}, "a"), Error);
  EXPECT_THROW(read_card(picture, {NAN, 30}, {80, 90}, "a"), Error);
  EXPECT_THROW(read_card(picture, {20, 30}, {24, 34}, "a"), Error);
  for (int x = 20; x < 80; ++x) picture.row(50)[3 * x + 1] = 255;
  EXPECT_THROW(read_card(picture, {20, 30}, {80, 90}, "a"), Error);
}

TEST(ColourChart, CornersThatCannotBe) {
  const Picture picture{width, height, 3, std::vector<std::uint8_t>(width * height * 3, 20)};
  EXPECT_THROW(read_chart(picture, {Vec2{30, 20}, {330, 40}, {280, 215}, {45, 200}}, "a"), Error);
  EXPECT_THROW(read_chart(picture, {Vec2{30, 20}, {280, 215}, {290, 40}, {45, 200}}, "a"), Error);
  EXPECT_THROW(read_chart(picture, {Vec2{30, 20}, {60, 20}, {60, 50}, {30, 50}}, "a"), Error);
  EXPECT_THROW(read_chart(picture, {Vec2{NAN, 20}, {60, 20}, {60, 50}, {30, 50}}, "a"), Error);
}

}  // namespace
}  // namespace polyhull
