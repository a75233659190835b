// SPDX-License-Identifier: LGPL-2.1-or-later
// The renderer's inner loops give the same bits for every instruction set.
#include "render/processor/loops/loops.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "base/instruction_set.h"
#include "base/srgb.h"

namespace polyhull::processor {
namespace {

#if defined(__x86_64__)

class RenderLoops : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_avx2()) GTEST_SKIP() << "this machine has the baseline only";
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
    for (auto& mean : tile.mean) fill(mean, 0.0f, 2.0f);
    fill(tile.normal_x, -0.1f, 0.1f);
    fill(tile.normal_y, 0.9f, 1.0f);
    fill(tile.normal_z, -0.1f, 0.1f);
    for (float& any : tile.any_normal) any = random() % 4 == 0 ? 1.0f : 0.0f;
    for (int i = 0; i < 30; ++i) tile.inverse[random() % ShadowTile::size] = 0.0f;
    fill(tile.ray, -1.0f, -0.5f);
    fill(tile.ray_x, 0.0f, 0.01f);
    fill(tile.ray_y, 0.0f, 0.01f);
    // And of three channels those of each.
    constexpr int channels = ShadowTile::channels;
    float baseline[channels][ShadowTile::side * ShadowTile::side],
        avx2[std::size(baseline)][std::size(baseline[0])];
    Loops::baseline().gather(tile, channels, baseline[0]);
    Loops::avx2().gather(tile, channels, avx2[0]);
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
    for (int c = 0; c < channels; ++c) {
      if (c > 0) std::copy(std::begin(tile.mean[c]), std::end(tile.mean[c]), tile.mean[0]);
      for (const Loops* loops : {&Loops::baseline(), &Loops::avx2()}) {
        loops->gather(tile, 1, avx2[0]);
        EXPECT_EQ(std::memcmp(baseline[c], avx2[0], sizeof avx2[0]), 0) << round;
      }
    }
  }
}

TEST_F(RenderLoops, GatherTakesAllOfAPlane) {
  // On a plane the shortcut gives what the long way does, which a hole in the corner asks for.
  constexpr int side = ShadowTile::side, reach = ShadowTile::reach, stride = ShadowTile::stride;
  for (int round = 0; round < 40; ++round) {
    ShadowTile tile{};
    fill(tile.mean[0], 0.0f, 2.0f);
    const float x = number(-0.3f, 0.3f), y = 1.0f, z = number(-0.3f, 0.3f), apart = 0.004f;
    tile.ray[0] = number(-0.5f, 0.5f), tile.ray[1] = -1.0f, tile.ray[2] = number(-0.5f, 0.5f);
    tile.ray_x[0] = apart, tile.ray_y[2] = apart;
    for (int j = 0; j < stride; ++j) {
      for (int i = 0; i < stride; ++i) {
        const int at = j * stride + i;
        const auto right = static_cast<float>(i - reach), down = static_cast<float>(j - reach);
        tile.inverse[at] = -0.3f * (x * (tile.ray[0] + right * apart) + y * tile.ray[1] +
                                    z * (tile.ray[2] + down * apart));
        tile.any_normal[at] = random() % 8 == 0 ? 1.0f : 0.0f;
        const float asked = 1.0f - tile.any_normal[at], length = std::sqrt(x * x + y * y + z * z);
        tile.normal_x[at] = asked * x / length;
        tile.normal_y[at] = asked * y / length;
        tile.normal_z[at] = asked * z / length;
      }
    }
    float flat[2][side * side], other[side * side];
    Loops::baseline().gather(tile, 1, flat[0]);
    Loops::avx2().gather(tile, 1, flat[1]);
    EXPECT_EQ(std::memcmp(flat[0], flat[1], sizeof flat[0]), 0) << round;
    tile.inverse[0] = 0.0f;
    Loops::baseline().gather(tile, 1, other);
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        if (i + j == 0 || tile.any_normal[(j + reach) * stride + i + reach] != 0.0f) continue;
        ASSERT_EQ(flat[0][j * side + i], other[j * side + i]) << i << " " << j;
      }
    }
  }
}

TEST_F(RenderLoops, TakeGivesTheSameBits) {
  for (int round = 0; round < 100; ++round) {
    float grid[2][9], of_grid[2][9];
    for (int row = 0; row < 2; ++row) {
      fill(grid[row], 0.3f, 0.32f);
      fill(of_grid[row], 0.0f, 1.0f);
    }
    const ShadowRows rows{{grid[0], grid[1]}, {of_grid[0], of_grid[1]}};
    float inverse[16], baseline[16], avx2[16];
    fill(inverse, 0.29f, 0.33f);
    inverse[round % 16] = 0.0f;
    Loops::baseline().take(rows, inverse, baseline);
    Loops::avx2().take(rows, inverse, avx2);
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
    EXPECT_EQ(baseline[round % 16], 0.0f) << "nothing is there";
    // Where all is of one surface it needs no weights: the others' columns are the same to the bit.
    for (float* depths : {grid[0], grid[1]})
      for (int k = 0; k < 9; ++k) depths[k] = 0.3f + 0.02f * (depths[k] - 0.3f);
    for (float& depth : inverse) depth = number(0.3f, 0.3003f);
    float alike[2][16];
    Loops::baseline().take(rows, inverse, alike[0]);
    Loops::avx2().take(rows, inverse, alike[1]);
    EXPECT_EQ(std::memcmp(alike[0], alike[1], sizeof alike[0]), 0) << round;
    inverse[round % 16] = 0.0f;
    Loops::baseline().take(rows, inverse, baseline);
    alike[0][round % 16] = 0.0f;
    EXPECT_EQ(std::memcmp(alike[0], baseline, sizeof baseline), 0) << round;
  }
}

TEST_F(RenderLoops, TakeSoftGivesTheSameBits) {
  for (int round = 0; round < 100; ++round) {
    SoftRows rows{};
    rows.step = round % 2 ? 4 : 2;
    rows.below = static_cast<float>(round % rows.step) / static_cast<float>(rows.step);
    // All alike, and of two surfaces.
    const float apart = round % 3 ? 0.03f : 0.0003f;
    float depths[2][SoftRows::most], shares[2][3][SoftRows::most];
    for (int row = 0; row < 2; ++row) {
      fill(depths[row], 0.3f, 0.3f + apart);
      rows.inverse[row] = depths[row];
      for (int c = 0; c < 3; ++c) {
        fill(shares[row][c], 0.0f, 1.0f);
        rows.taken[row][c] = shares[row][c];
      }
    }
    float inverse[16], baseline[3][16], avx2[3][16];
    fill(inverse, 0.3f, 0.3f + apart);
    if (round % 4 == 0) inverse[round % 16] = 0.0f;
    Loops::baseline().take_soft(rows, inverse, baseline);
    Loops::avx2().take_soft(rows, inverse, avx2);
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
    for (const auto& taken : baseline)
      for (int i = 0; i < 16; ++i) {
        EXPECT_TRUE(taken[i] >= 0.0f && taken[i] <= 1.0001f) << "a mean of what is around";
        if (inverse[i] == 0.0f) {
          EXPECT_EQ(taken[i], 0.0f) << "nothing is there";
        }
      }
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
    fill(pixels.covered, 0.0f, 1.0f);
    fill(pixels.alpha, 0.0f, round % 2 == 0 ? 0.0f : 1.0f);
    for (int c = 0; c < 3; ++c) {
      fill(pixels.taken[c], 0.0f, round % 3 == 0 ? 0.0f : 2.0f);
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
        Loops::baseline().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), baseline);
    EXPECT_EQ(Loops::avx2().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), avx2),
              changed);
    int others = 0;
    for (int i = 0; i < BlendPixels::count; ++i) others += baseline[i] != pixels.background[i];
    EXPECT_EQ(changed, others) << round;
    EXPECT_EQ(std::memcmp(baseline, avx2, sizeof baseline), 0) << round;
    // What has neither subject nor mirror needs nothing of theirs.
    for (int i = 0; i < BlendPixels::count; ++i) {
      pixels.keep[i] = 1.0f;
      pixels.covered[i] = pixels.alpha[i] = pixels.red[i] = pixels.green[i] = pixels.blue[i] = 0.0f;
      for (auto* values : {pixels.dimmed, pixels.gone, pixels.more})
        for (int c = 0; c < 3; ++c) values[c][i] = 0.0f;
    }
    Loops::baseline().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), baseline);
    pixels.layered = false;
    for (const Loops* loops : {&Loops::baseline(), &Loops::avx2()}) {
      std::uint32_t dimmed[BlendPixels::count];
      loops->blend(pixels, power, srgb_to_linear_table(), srgb_lines(), dimmed);
      EXPECT_EQ(std::memcmp(baseline, dimmed, sizeof baseline), 0) << round;
    }
  }
}

/// Points and a view of them, its picture, its map of depths and a flow in it.
struct Seen {
  static constexpr int count = 64, side = 40;
  float x[count], y[count], z[count], depth[count], weight[count], share[count];
  std::vector<std::uint32_t> pixels[2];
  std::vector<SkinTexel> map;
  std::vector<std::int8_t> offsets;
  SkinView views[2];
  SkinFlow flow;
  SkinPoints points() const { return {count, x, y, z, depth}; }
};

struct Coloured {
  float u[Seen::count], v[Seen::count], weight[Seen::count];
  float red[Seen::count], green[Seen::count], blue[Seen::count], alpha[Seen::count];
};

/// All that is done to the points of one view.
Coloured coloured(const Loops& loops, const Seen& seen, bool matte, const float* colour) {
  Coloured out{};
  std::copy_n(seen.weight, Seen::count, out.weight);
  loops.look(seen.views[0], seen.points(), matte ? 1e-3f : 0.0f, out.u, out.v, out.weight);
  loops.displace(seen.flow, Seen::count, seen.share, out.u, out.v);
  loops.add({seen.views, 2, 60.0f, colour}, seen.points(), out.weight, srgb_to_linear_table(),
            out.u, out.v, {out.red, out.green, out.blue, matte ? out.alpha : nullptr});
  return out;
}

TEST_F(RenderLoops, SkinGivesTheSameBits) {
  const float colour[9] = {0.9f, 0.1f, 0.0f, -0.1f, 1.1f, 0.1f, 0.0f, 0.2f, 0.8f};
  for (int round = 0; round < 40; ++round) {
    Seen seen;
    fill(seen.x, -0.5f, 0.5f);
    fill(seen.y, -0.5f, 0.5f);
    fill(seen.z, round % 4 == 0 ? -1.0f : 1.5f, 2.0f);  // some behind the camera
    fill(seen.depth, 0.8f, 4.0f);
    fill(seen.share, 0.0f, 1.0f);
    for (float& weight : seen.weight) weight = random() % 3 == 0 ? 0.0f : number(0.0f, 1.0f);
    const int side = Seen::side;
    for (int level = 0; level < 2; ++level) {
      SkinView& view = seen.views[level];
      const float rows[3][4] = {
          {60.0f, 0.0f, 20.0f, 0.0f}, {0.0f, 60.0f, 20.0f, 0.0f}, {0.0f, 0.0f, 1.0f, 0.0f}};
      std::memcpy(view.pixel_from_local, rows, sizeof rows);
      view.width = view.height = view.stride = level == 0 ? side : side / 2 + 1;
      view.scale = level == 0 ? 1.0f : 0.5f;
      seen.pixels[level].resize(static_cast<std::size_t>(side * side));
      for (std::uint32_t& pixel : seen.pixels[level]) pixel = static_cast<std::uint32_t>(random());
      view.pixels = seen.pixels[level].data();
      view.distorted = round % 2 == 0;
      view.fx = view.fy = 60.0f, view.cx = view.cy = 20.0f;
      for (float& k : view.lens) k = number(-0.1f, 0.1f);
    }
    if (round % 3 != 0) {
      SkinView& view = seen.views[0];
      seen.map.resize(static_cast<std::size_t>((side + 1) * (side + 2) + 1));
      for (SkinTexel& texel : seen.map) texel = {number(0.0f, 1.0f), number(0.0f, 1.0f)};
      view.map = seen.map.data();
      view.map_width = view.map_height = side;
      view.map_stride = side + 1;
      view.map_near = 1.5f, view.map_range = 0.5f, view.tolerance = 0.1f, view.rest = 0.002f;
    }
    seen.offsets.resize(static_cast<std::size_t>(2 * side * side));
    for (std::int8_t& offset : seen.offsets) offset = static_cast<std::int8_t>(random());
    seen.flow = {seen.offsets.data(), side, side, 0.0f, 0.0f, 1.0f, 0.02f, 0, 0.5f};
    for (const bool matte : {false, true}) {
      const float* const to = round % 5 == 0 ? colour : nullptr;
      const Coloured baseline = coloured(Loops::baseline(), seen, matte, to);
      const Coloured avx2 = coloured(Loops::avx2(), seen, matte, to);
      for (int i = 0; i < Seen::count; ++i) {
        ASSERT_EQ(baseline.weight[i], avx2.weight[i]) << round << " " << i;
        ASSERT_EQ(baseline.red[i], avx2.red[i]) << round << " " << i;
        ASSERT_EQ(baseline.green[i], avx2.green[i]) << round << " " << i;
        ASSERT_EQ(baseline.blue[i], avx2.blue[i]) << round << " " << i;
        ASSERT_EQ(baseline.alpha[i], avx2.alpha[i]) << round << " " << i;
      }
    }
  }
}

TEST_F(RenderLoops, MasksGiveTheSameBits) {
  for (int round = 0; round < 40; ++round) {
    std::uint32_t bits[8 * 40], moved[2][2][8 * 40] = {};
    for (std::uint32_t& word : bits) word = static_cast<std::uint32_t>(random());
    const int eights = 40 - round, by = round % 32;
    Loops::baseline().shift_onto(bits, eights, by, moved[0][0], moved[0][1]);
    Loops::avx2().shift_onto(bits, eights, by, moved[1][0], moved[1][1]);
    EXPECT_EQ(std::memcmp(moved[0], moved[1], sizeof moved[0]), 0) << round;
    for (int i = 0; i < 8 * eights; ++i)
      ASSERT_EQ(std::uint64_t{moved[0][1][i]} << 32 | moved[0][0][i], std::uint64_t{bits[i]} << by);
    float x[101], y[101], w[101];
    fill(x, -2.0f, 2.0f);
    fill(y, -2.0f, 2.0f);
    fill(w, 0.0f, 1.0f);
    const MaskImage image{bits, 250, 40, {60.0f, 12.0f}, {120.0f, 20.0f}, {-9.0f, 5.0f}};
    std::uint32_t found[2][101] = {};
    Loops::baseline().look_up(image, {101, x, y, w}, 4, found[0]);
    Loops::avx2().look_up(image, {101, x, y, w}, 4, found[1]);
    EXPECT_EQ(std::memcmp(found[0], found[1], sizeof found[0]), 0) << round;
  }
}

TEST_F(RenderLoops, LampGivesTheSameBits) {
  for (int round = 0; round < 40; ++round) {
    LampPlaces places;
    fill(places.x, -1.0f, 1.0f);
    fill(places.y, 2.0f, 2.1f);
    fill(places.z, -1.0f, 1.0f);
    places.facing[0] = places.facing[2] = 0.0f, places.facing[1] = -1.0f;
    float at[3], normal[3];
    fill(at, -1.0f, 1.9f);
    fill(normal, -0.6f, 0.6f);
    const auto which = static_cast<std::uint32_t>(random()) & 0xffffu;
    float sum = 0.0f;
    for (int i = 0; i < LampPlaces::most; ++i) {
      const float x = places.x[i] - at[0], y = places.y[i] - at[1], z = places.z[i] - at[2];
      const float cosines = std::max(normal[0] * x + normal[1] * y + normal[2] * z, 0.0f) * y;
      const float distance_2 = x * x + y * y + z * z;
      if (which >> i & 1) sum += cosines / (distance_2 * distance_2);
    }
    const float given = Loops::baseline().given(places, at, normal, which);
    EXPECT_NEAR(given, sum, 1e-5f * (1.0f + sum)) << round;
    EXPECT_EQ(given, Loops::avx2().given(places, at, normal, which)) << round;
  }
}

#endif

TEST(SkinLoops, SpreadBringsEachNumberToItsPlace) {
  float records[16 * 9], to[4][12];
  for (int i = 0; i < 16 * 9; ++i) records[i] = static_cast<float>(i);
  const std::uint32_t which[12] = {3, 0, 8, 1, 1, 7, 2, 2, 2, 6, 5, 4};
  Loops::best().spread(records + 5, which, 12, {to[0], to[1], to[2], to[3]});
  for (int i = 0; i < 12; ++i)
    for (int k = 0; k < 4; ++k)
      EXPECT_EQ(to[k][i], static_cast<float>(16 * which[i] + 5 + static_cast<std::uint32_t>(k)));
}

TEST(SkinLoops, SettleKeepsTheBestLessTheNext) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> number(0.0f, 1.0f);
  for (int views = 1; views <= 64; views += views < 6 ? 1 : 19) {
    for (int best = 1; best <= 5; ++best) {
      constexpr int count = 16;
      std::vector<std::vector<float>> before, after;
      std::vector<float*> rows;
      for (int k = 0; k < views; ++k)
        for (float& weight : before.emplace_back(count))
          weight = random() % 4 == 0 ? 0.5f : number(random);  // some alike
      for (int k = 0; k < views; ++k) before[static_cast<std::size_t>(k)][0] = 0.0f;
      after = before;
      for (std::vector<float>& row : after) rows.push_back(row.data());
      float red[count], green[count], blue[count];
      for (float* colour : {red, green, blue}) std::fill_n(colour, count, 0.25f);
      Loops::best().settle(rows.data(), views, best, 1e-4f, count, {red, green, blue, nullptr});
      for (int i = 0; i < count; ++i) {
        std::vector<float> sorted;
        for (const std::vector<float>& row : before)
          sorted.push_back(row[static_cast<std::size_t>(i)]);
        std::sort(sorted.rbegin(), sorted.rend());
        const float next = best < views ? sorted[static_cast<std::size_t>(best)] : 0.0f;
        const float off = std::min(next, 0.999f * sorted[0]);
        float total = 0.0f;
        for (const float weight : sorted) total += std::max(weight - off, 0.0f);
        for (std::size_t k = 0; k < before.size(); ++k) {
          const float kept = std::max(before[k][static_cast<std::size_t>(i)] - off, 0.0f);
          EXPECT_NEAR(after[k][static_cast<std::size_t>(i)], i == 0 ? 0.0f : kept / total, 1e-5f)
              << views << " " << best << " " << i;
        }
        EXPECT_EQ(green[i], i == 0 ? 0.25f : 0.0f) << "where no view weighs, the colour stays";
      }
    }
  }
}

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
    Loops::baseline().blend(pixels, power, srgb_to_linear_table(), srgb_lines(), out);
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
