// SPDX-License-Identifier: LGPL-2.1-or-later
// The renderer's inner loops give the same bits for every instruction set.
#include "render/processor/loops.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "base/srgb.h"

namespace polyhull::processor {
namespace {

#if defined(__x86_64__)

class RenderLoops : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi2") ||
        !__builtin_cpu_supports("fma"))
      GTEST_SKIP() << "this machine has the baseline only";
  }
  float number(float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  }
  template <std::size_t count>
  void fill(float (&numbers)[count], float low, float high) {
    for (float& value : numbers) value = number(low, high);
  }
  std::mt19937 random{17};
};

TEST_F(RenderLoops, GatherGivesTheSameBits) {
  for (int round = 0; round < 40; ++round) {
    ShadowTile tile;
    fill(tile.inverse, 0.3f, 0.3f + 0.02f * static_cast<float>(round % 5));
    fill(tile.mean, 0.0f, 2.0f);
    fill(tile.normal_x, -0.1f, 0.1f);
    fill(tile.normal_y, 0.9f, 1.0f);
    fill(tile.normal_z, -0.1f, 0.1f);
    for (float& any : tile.any_normal) any = random() % 4 == 0 ? 1.0f : 0.0f;
    for (int i = 0; i < 30; ++i) tile.inverse[random() % ShadowTile::size] = 0.0f;
    fill(tile.ray, -1.0f, -0.5f);
    fill(tile.ray_x, 0.0f, 0.01f);
    fill(tile.ray_y, 0.0f, 0.01f);
    float baseline[ShadowTile::side * ShadowTile::side], avx2[ShadowTile::side * ShadowTile::side];
    baseline_loops().gather(tile, baseline);
    avx2_loops().gather(tile, avx2);
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
  }
}

TEST_F(RenderLoops, TakeGivesTheSameBits) {
  for (int round = 0; round < 100; ++round) {
    ShadowRows rows;
    for (int row = 0; row < 2; ++row) {
      fill(rows.inverse[row], 0.3f, 0.32f);
      fill(rows.taken[row], 0.0f, 1.0f);
    }
    float inverse[16], baseline[16], avx2[16];
    fill(inverse, 0.29f, 0.33f);
    inverse[round % 16] = 0.0f;
    baseline_loops().take(rows, inverse, baseline);
    avx2_loops().take(rows, inverse, avx2);
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
    EXPECT_EQ(baseline[round % 16], 0.0f) << "nothing is there";
  }
}

TEST_F(RenderLoops, BlendGivesTheSameBytes) {
  for (int round = 0; round < 200; ++round) {
    BlendPixels pixels;
    for (int i = 0; i < BlendPixels::count; ++i) {
      pixels.background[i] = static_cast<std::uint32_t>(random());
      pixels.albedo[i] = (static_cast<std::uint64_t>(random()) << 32 | random()) >> 16;
      pixels.keep[i] = random() % 2 ? 1.0f : number(0.0f, 1.0f);
    }
    fill(pixels.taken, 0.0f, round % 3 == 0 ? 0.0f : 2.0f);
    fill(pixels.covered, 0.0f, 1.0f);
    fill(pixels.alpha, 0.0f, round % 2 == 0 ? 0.0f : 1.0f);
    for (int c = 0; c < 3; ++c) {
      fill(pixels.dimmed[c], 0.0f, round % 4 == 0 ? 0.0f : 0.3f);
      fill(pixels.gone[c], 0.0f, round % 5 == 0 ? 0.0f : 0.5f);
      fill(pixels.more[c], 0.0f, round % 5 == 0 ? 0.0f : 0.5f);
    }
    fill(pixels.red, 0.0f, 1.2f);
    fill(pixels.green, 0.0f, 1.2f);
    fill(pixels.blue, 0.0f, 1.2f);
    const float power[3] = {0.7f, 0.6f, 0.5f};
    std::uint32_t baseline[BlendPixels::count], avx2[BlendPixels::count];
    const int changed =
        baseline_loops().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), baseline);
    EXPECT_EQ(avx2_loops().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), avx2),
              changed);
    int others = 0;
    for (int i = 0; i < BlendPixels::count; ++i) others += baseline[i] != pixels.background[i];
    EXPECT_EQ(changed, others) << round;
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
  }
}

TEST_F(RenderLoops, MasksGiveTheSameBits) {
  for (int round = 0; round < 40; ++round) {
    std::uint32_t bits[1 + 8 * 40], shifted[2][16 * 40] = {};
    for (std::uint32_t& word : bits) word = static_cast<std::uint32_t>(random());
    const int count = 8 * 40 - round, moved = round % 32;
    baseline_loops().shift_onto(bits + 1, count, moved, shifted[0]);
    avx2_loops().shift_onto(bits + 1, count, moved, shifted[1]);
    EXPECT_EQ(std::memcmp(shifted[0], shifted[1], sizeof shifted[0]), 0) << round;
    float x[101], y[101], w[101];
    fill(x, -2.0f, 2.0f);
    fill(y, -2.0f, 2.0f);
    fill(w, 0.0f, 1.0f);
    const MaskImage image{bits, 8, 250, 40, {60.0f, 12.0f}, {120.0f, 20.0f}, {-9.0f, 5.0f}};
    std::uint32_t found[2][101] = {};
    baseline_loops().look_up(image, {101, x, y, w}, 4, found[0]);
    avx2_loops().look_up(image, {101, x, y, w}, 4, found[1]);
    EXPECT_EQ(std::memcmp(found[0], found[1], sizeof found[0]), 0) << round;
  }
}

#endif

// The lines through the curve give the nearest byte, or that beside it where it is as good as half way.
TEST(SrgbLines, GiveTheNearestByte) {
  BlendPixels pixels{};
  const float power[3] = {};
  for (int i = 0; i < BlendPixels::count; ++i) pixels.alpha[i] = 1.0f;
  int beside = 0, all = 0;
  for (int step = 0; step < 65536; step += BlendPixels::count) {
    for (int i = 0; i < BlendPixels::count; ++i)
      pixels.red[i] = pixels.green[i] = pixels.blue[i] = static_cast<float>(step + i) / 65535.0f;
    std::uint32_t out[BlendPixels::count];
    baseline_loops().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), out);
    for (int i = 0; i < BlendPixels::count; ++i, ++all) {
      const double exact = 255.0 * srgb_encoded(static_cast<double>(pixels.red[i]));
      EXPECT_NEAR(out[i] & 255u, exact, 0.52);
      beside += std::abs(static_cast<double>(out[i] & 255u) - exact) > 0.5;
    }
  }
  EXPECT_LT(beside, all / 50);
}

}  // namespace
}  // namespace polyhull::processor
