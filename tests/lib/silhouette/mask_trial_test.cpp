// SPDX-License-Identifier: LGPL-2.1-or-later
// Random masks through blur, tracer and approximation; the fuzzer tests/fuzz/mask_fuzzer.cpp checks
// the same of masks that are not random. POLYHULL_MASKS sets how many (default 4000).
#include "support/mask_trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "support/ring_checks.h"

namespace polyhull {
namespace {

TEST(MaskTrial, RandomMasksKeepEveryPromise) {
  const char* wanted = std::getenv("POLYHULL_MASKS");
  const int count = wanted != nullptr ? std::atoi(wanted) : 4000;
  int with_rings = 0, with_holes = 0;
  for (int seed = 0; seed < count; ++seed) {
    std::mt19937 random(static_cast<unsigned>(seed));
    std::vector<std::uint8_t> bytes(13 + random() % 300);
    const unsigned sparse = 1 + random() % 3;  // and of several draws: fewer bits
    for (auto& b : bytes) {
      b = static_cast<std::uint8_t>(random());
      for (unsigned k = 1; k < sparse; ++k) b &= static_cast<std::uint8_t>(random());
    }
    for (std::size_t i = 0; i < 12; ++i) bytes[i] = static_cast<std::uint8_t>(random());
    const test::MaskTrial trial = test::mask_from_bytes(bytes);
    ASSERT_EQ(test::fault_of(trial), "") << "seed " << seed << ": " << trial.describe();
    const auto set = std::count_if(trial.levels.begin(), trial.levels.end(),
                                   [](std::uint8_t level) { return level > 127; });
    with_rings += set > 0;
    with_holes += set > 0 && set < static_cast<std::ptrdiff_t>(trial.levels.size());
  }
  // The masks are worth the name.
  EXPECT_GT(with_rings, count * 3 / 4);
  EXPECT_GT(with_holes, count * 3 / 4);
}

// The checks find what they are for.
TEST(MaskTrial, FaultsAreFound) {
  const auto rings_of = [](std::vector<Vec2f> points) {
    Rings rings;
    rings.ends = {static_cast<std::uint32_t>(points.size())};
    rings.points = std::move(points);
    return rings;
  };
  EXPECT_NE(test::meeting_edges(rings_of({{0, 0}, {4, 4}, {4, 0}, {0, 4}})), "");
  EXPECT_NE(test::meeting_edges(rings_of({{0, 0}, {0, 4}})), "");
  EXPECT_NE(test::meeting_edges(rings_of({{0, 0}, {0, 4}, {0, 2}, {4, 2}})), "");
  EXPECT_NE(test::meeting_edges(rings_of({{0, 0}, {0, 0}, {0, 4}, {4, 2}})), "");
  EXPECT_EQ(test::meeting_edges(rings_of({{0, 0}, {0, 4}, {4, 4}})), "");
  // Clockwise on screen and alone: a hole in nothing.
  EXPECT_NE(test::nesting_fault(rings_of({{0, 0}, {4, 0}, {4, 4}})), "");
  EXPECT_EQ(test::nesting_fault(rings_of({{0, 0}, {4, 4}, {4, 0}})), "");

  std::vector<std::uint8_t> levels(64, 0);
  for (int y = 2; y < 6; ++y)
    for (int x = 2; x < 6; ++x) levels[static_cast<std::size_t>(8 * y + x)] = 255;
  Matte matte;
  load_matte(levels.data(), 8, 1, 8, 8, matte);
  Field field;
  load_field(matte, field);
  // The corners of a square are cut off; the two levels lie within 1/32640 of the edges' length.
  EXPECT_NEAR(test::marching_area(field).least, 16.0 - 4 * 0.125, 1e-9);
  EXPECT_NEAR(test::marching_area(field).most, 16.0 - 4 * 0.125, 1e-3);
  EXPECT_GT(test::marching_area(field).most, test::marching_area(field).least);
  const Rings square = rings_of({{1.5, 1.5}, {1.5, 5.5}, {5.5, 5.5}, {5.5, 1.5}});
  EXPECT_EQ(test::misplaced_pixel(square, field), "");
  const Rings short_one = rings_of({{1.5, 1.5}, {1.5, 4.5}, {5.5, 5.5}, {5.5, 1.5}});
  EXPECT_NE(test::misplaced_pixel(short_one, field), "");
  EXPECT_DOUBLE_EQ(test::one_sided_distance(square, short_one, 0.5), 1.0 * 4 / std::hypot(4, 1));
}

}  // namespace
}  // namespace polyhull
