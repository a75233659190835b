// SPDX-License-Identifier: LGPL-2.1-or-later
// The rasteriser: which samples belong to which triangle, and which sides are drawn.
#include "raster/screen_triangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "base/instruction_set.h"
#include "raster/covered_blocks.h"

namespace polyhull {
namespace {

constexpr int width = 40, height = 2 * band_rows;
constexpr float places[2][2] = {{0.25f, 0.6f}, {0.75f, 0.1f}};

/// The ids that the samples show, by sample, row and column.
std::vector<std::uint32_t> drawn(const ScreenTriangles& triangles) {
  std::vector<std::uint32_t> ids(2 * width * height, no_triangle);
  std::vector<float> inverse(ids.size(), 0.0f);
  SampleRows rows{0, width, 0, height, 2, places, inverse.data(), ids.data()};
  for (int band = 0; band < height / band_rows; ++band) {
    std::vector<std::uint32_t> part(2 * width * band_rows, no_triangle);
    std::vector<float> depth(part.size(), 0.0f);
    rows = {0, width,  band * band_rows, (band + 1) * band_rows,
            2, places, depth.data(),     part.data()};
    triangles.draw(band, rows);
    for (int s = 0; s < 2; ++s)
      std::copy_n(part.begin() + s * width * band_rows, width * band_rows,
                  ids.begin() + s * width * height + band * width * band_rows);
  }
  for (std::uint32_t& id : ids)
    if (id != no_triangle) id = triangles.piece(id).id;
  return ids;
}

std::array<Corner, 3> corners(const Vec3& a, const Vec3& b, const Vec3& c) {
  std::array<Corner, 3> out;
  for (int i = 0; i < 3; ++i) {
    const Vec3& p = i == 0 ? a : i == 1 ? b : c;
    out[static_cast<std::size_t>(i)].pixel = {p.x * p.z, p.y * p.z, p.z};
  }
  return out;
}

std::size_t covered(const std::vector<std::uint32_t>& ids) {
  return ids.size() - static_cast<std::size_t>(std::count(ids.begin(), ids.end(), no_triangle));
}

TEST(ScreenTriangles, OneSideIsDrawn) {
  const Vec3 a(5, 5, 2), b(30, 8, 2), c(10, 25, 2);
  const auto sides = [&](const Vec3& second, const Vec3& third, Facing facing) {
    ScreenTriangles triangles;
    triangles.begin(width, height);
    triangles.add(corners(a, second, third), 7, facing);
    return covered(drawn(triangles)) > 0;
  };
  // Rows go down: a, b, c go round clockwise to the eye, as triangles do that are seen from outside
  // once y up has become y down.
  for (const bool turned : {false, true}) {
    const Vec3 &second = turned ? c : b, &third = turned ? b : c;
    EXPECT_TRUE(sides(second, third, Facing::both));
    EXPECT_EQ(sides(second, third, Facing::clockwise), turned);
    EXPECT_EQ(sides(second, third, Facing::counterclockwise), !turned);
  }
}

// Outside of a band's columns nothing is drawn, and they are no wider than what may be.
TEST(ScreenTriangles, ColumnsHoldAllThatIsDrawn) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(-8.0, width + 8.0), y(-8.0, height + 8.0);
  bool first = false, last = false;
  for (int trial = 0; trial < 400; ++trial) {
    const Vec3 a(x(random), y(random), 2), b(x(random), y(random), 2), c(x(random), y(random), 2);
    ScreenTriangles triangles;
    triangles.begin(width, height);
    triangles.add(corners(a, b, c), 7, Facing::both);
    const std::vector<std::uint32_t> ids = drawn(triangles);
    for (int band = 0; band < height / band_rows; ++band) {
      const auto columns = triangles.columns(band);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        const int at = static_cast<int>(i % width), row = static_cast<int>(i / width % height);
        if (ids[i] == no_triangle || row / band_rows != band) continue;
        ASSERT_GE(at, columns.first);
        ASSERT_LT(at, columns.end);
        first |= at == columns.first;
        last |= at == columns.end - 1;
      }
      if (columns.first >= columns.end) continue;
      EXPECT_GE(columns.first, 0);
      EXPECT_LE(columns.end, width);
    }
  }
  EXPECT_TRUE(first && last);
}

// A fan of slivers over the whole picture: every sample shows exactly the triangle that holds it.
TEST(ScreenTriangles, NeighboursShareNoSampleAndLeaveNone) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  for (int round = 0; round < 50; ++round) {
    const Vec3 middle(place(random) * width, place(random) * height, 1.0);
    std::vector<Vec3> rim;
    for (int i = 0; i < 60; ++i) {
      const double angle = 6.283185307179586 * (i + 0.9 * place(random)) / 60;
      rim.push_back(middle + Vec3(90.0 * std::cos(angle), 90.0 * std::sin(angle), 0.0));
    }
    ScreenTriangles triangles;
    triangles.begin(width, height);
    for (std::size_t i = 0; i < rim.size(); ++i)
      triangles.add(corners(middle, rim[i], rim[(i + 1) % rim.size()]),
                    static_cast<std::uint32_t>(i), Facing::both);
    const std::vector<std::uint32_t> ids = drawn(triangles);
    ASSERT_EQ(covered(ids), ids.size()) << "samples without a triangle";
    for (std::size_t k = 0; k < ids.size(); ++k) {
      const std::size_t s = k / (width * height), at = k % (width * height);
      const Vec3 p(static_cast<double>(at % width) + places[s][0],
                   static_cast<double>(at / width) + places[s][1], 1.0);
      const auto side = [&](const Vec3& q) {
        return (q.x - middle.x) * (p.y - middle.y) - (q.y - middle.y) * (p.x - middle.x);
      };
      EXPECT_GE(side(rim[ids[k]]), -1e-3);
      EXPECT_LE(side(rim[(ids[k] + 1) % rim.size()]), 1e-3);
    }
  }
}

TEST(ScreenTriangles, TheNearestShows) {
  ScreenTriangles triangles;
  triangles.begin(width, height);
  triangles.add(corners({-50, -50, 2}, {90, -50, 2}, {0, 150, 2}), 1, Facing::both);
  triangles.add(corners({-50, -50, 1}, {90, -50, 1}, {0, 150, 1}), 2, Facing::both);
  triangles.add(corners({-50, -50, 3}, {90, -50, 3}, {0, 150, 3}), 3, Facing::both);
  const std::vector<std::uint32_t> ids = drawn(triangles);
  EXPECT_GT(covered(ids), ids.size() / 2);
  for (const std::uint32_t id : ids) EXPECT_TRUE(id == 2 || id == no_triangle);
}

/// Three corners somewhere around the picture, at most so large.
std::array<Corner, 3> any_triangle(std::mt19937& random, double size) {
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Vec3 at(number(-5, width + 5), number(-5, height + 5), 0.0);
  const auto corner = [&] {
    return at + Vec3(number(-size, size), number(-size, size), number(1.0, 3.0));
  };
  return corners(corner(), corner(), corner());
}

/// What the samples of each pixel show; from packed rows or others, by pixel and sample.
std::vector<std::uint32_t> shown(const ScreenTriangles& triangles, int samples, bool packed) {
  std::vector<std::uint32_t> out;
  constexpr std::size_t pixels = width * band_rows;
  const auto each = static_cast<std::size_t>(samples);
  for (int band = 0; band < height / band_rows; ++band) {
    std::vector<std::uint32_t> ids(each * pixels, no_triangle);
    std::vector<float> depth(ids.size(), 0.0f);
    triangles.draw(band, {0, width, band * band_rows, (band + 1) * band_rows, samples,
                          sample_places(samples), depth.data(), ids.data(), packed});
    for (std::size_t i = 0; i < pixels; ++i)
      for (std::size_t s = 0; s < each; ++s)
        out.push_back(ids[packed ? i * each + s : s * pixels + i]);
  }
  return out;
}

// But where an edge passes through a sample, or two triangles through each other there.
TEST(ScreenTriangles, PackedRowsShowTheSame) {
  std::mt19937 random(11);
  std::size_t different = 0, all = 0, covered = 0;
  for (const double size : {0.7, 3.0, 12.0, 90.0}) {
    for (int round = 0; round < 32; ++round) {
      const int samples = 1 << round % 4;
      ScreenTriangles triangles;
      triangles.begin(width, height);
      for (std::uint32_t i = 0; i < 60; ++i)
        triangles.add(any_triangle(random, size), i, Facing::both);
      const auto apart = shown(triangles, samples, false);
      const auto packed = shown(triangles, samples, true);
      all += apart.size();
      for (std::size_t i = 0; i < apart.size(); ++i) {
        covered += apart[i] != no_triangle;
        different += apart[i] != packed[i];
      }
    }
  }
  EXPECT_GT(covered, all / 4);
  EXPECT_LT(different, all / 20000);
}

// Level edges: above the first and below the last line nothing is drawn.
TEST(ScreenTriangles, PackedRectanglesShowTheSame) {
  for (const double end : {20.05, 20.3, 20.55, 20.8}) {
    ScreenTriangles triangles;
    triangles.begin(width, height);
    const Vec3 a(3.3, end - 16.0, 2), b(30.3, end - 16.0, 2), c(3.3, end, 2), d(30.3, end, 2);
    triangles.add(corners(a, b, c), 1, Facing::both);
    triangles.add(corners(b, d, c), 2, Facing::both);
    for (const int samples : {4, 8}) {
      const auto packed = shown(triangles, samples, true);
      EXPECT_GT(covered(packed), 16u * 26u * static_cast<std::size_t>(samples));
      EXPECT_EQ(packed, shown(triangles, samples, false)) << end;
    }
  }
}

// Triangles around a point, drawn packed one by one: no sample twice, and none left out.
TEST(ScreenTriangles, PackedNeighboursShareNoSampleAndLeaveNone) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  for (int round = 0; round < 50; ++round) {
    const Vec3 middle(place(random) * width, place(random) * height, 1.0);
    std::vector<Vec3> rim;
    for (int i = 0; i < 40; ++i) {
      const double angle = 6.283185307179586 * (i + 0.9 * place(random)) / 40;
      rim.push_back(middle + Vec3(90.0 * std::cos(angle), 90.0 * std::sin(angle), 0.0));
    }
    const int samples = 1 << round % 4;
    std::vector<int> times(static_cast<std::size_t>(samples) * width * height, 0);
    for (std::size_t i = 0; i < rim.size(); ++i) {
      ScreenTriangles triangles;
      triangles.begin(width, height);
      triangles.add(corners(middle, rim[i], rim[(i + 1) % rim.size()]), 0, Facing::both);
      const auto ids = shown(triangles, samples, true);
      for (std::size_t k = 0; k < ids.size(); ++k) times[k] += ids[k] != no_triangle;
    }
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), static_cast<std::ptrdiff_t>(times.size()));
  }
}

// To the bit, also where triangles go on beside it.
TEST(ScreenTriangles, PackedRowsDoNotDependOnThePartThatIsAskedFor) {
  std::mt19937 random(7);
  for (const int samples : {1, 2, 4, 8}) {
    ScreenTriangles triangles;
    triangles.begin(width, height);
    for (std::uint32_t i = 0; i < 60; ++i)
      triangles.add(any_triangle(random, i % 3 ? 12.0 : 90.0), i, Facing::both);
    const auto drawn = [&](int left, int right) {
      std::vector<std::uint32_t> ids(static_cast<std::size_t>(samples * (right - left) * band_rows),
                                     no_triangle);
      std::vector<float> depth(ids.size(), 0.0f);
      triangles.draw(0, {left, right, 0, band_rows, samples, sample_places(samples), depth.data(),
                         ids.data(), true});
      std::vector<std::pair<std::uint32_t, float>> out;  // of columns 16 to 31
      for (int row = 0; row < band_rows; ++row)
        for (int i = 16 * samples; i < 32 * samples; ++i) {
          const auto at = static_cast<std::size_t>((row * (right - left) - left) * samples + i);
          out.emplace_back(ids[at], depth[at]);
        }
      return out;
    };
    EXPECT_EQ(drawn(0, width), drawn(16, 32)) << samples;
  }
}

TEST(ScreenTriangles, PackedRowsHaveTheSameBitsForEveryInstructionSet) {
#if defined(__x86_64__)
  if (!has_avx2()) GTEST_SKIP() << "this machine has no AVX2";
  std::mt19937 random(2);
  constexpr std::size_t samples = packed_samples * width * band_rows;
  std::vector<std::uint32_t> ids[2] = {std::vector<std::uint32_t>(samples, no_triangle), {}};
  std::vector<float> depth[2] = {std::vector<float>(samples, 0.0f), {}};
  ids[1] = ids[0];
  depth[1] = depth[0];
  ScreenTriangles triangles;
  triangles.begin(width, height);
  for (std::uint32_t i = 0; i < 60; ++i)
    triangles.add(any_triangle(random, i % 3 ? 3.0 : 12.0), i, Facing::both);
  for (std::uint32_t i = 0; i < triangles.pieces(); ++i) {
    for (int k = 0; k < 2; ++k) {
      const RasterLoops& loops = k == 0 ? RasterLoops::baseline() : RasterLoops::avx2();
      loops.draw_packed(&triangles.piece(0), &i, 1, 0,
                        {0, width, 0, band_rows, packed_samples, sample_places(packed_samples),
                         depth[k].data(), ids[k].data(), true});
    }
  }
  EXPECT_GT(std::count(ids[0].begin(), ids[0].end(), no_triangle), 0);
  EXPECT_EQ(ids[0], ids[1]);
  EXPECT_EQ(depth[0], depth[1]);
#endif
}

/// Blocks of columns \p left and on of band \p band that have got all triangles.
CoveredBlocks looked_at(const ScreenTriangles& triangles, int band, int left) {
  CoveredBlocks blocks;
  blocks.begin(left, width, band * band_rows, (band + 1) * band_rows);
  triangles.each(band, 0, [&](const ScreenTriangle& t, auto number) { blocks.cover(t, number); });
  triangles.each(band, 0, [&](const ScreenTriangle& t, auto number) { blocks.show(t, number); });
  return blocks;
}

/// What the samples of a block show if only what may be seen there is drawn.
std::vector<std::uint32_t> shown_in(const ScreenTriangles& triangles, int band,
                                    const CoveredBlocks& blocks, int block, int left, int right) {
  std::vector<std::uint32_t> numbers;
  for (const CoveredBlocks::Shown& shown : blocks.shown())
    if (shown.first <= block && shown.last >= block) numbers.push_back(shown.number);
  std::vector<std::uint32_t> ids(
      static_cast<std::size_t>(packed_samples * band_rows * (right - left)), no_triangle);
  std::vector<float> depth(ids.size(), 0.0f);
  triangles.draw(std::span(numbers),
                 {left, right, band * band_rows, (band + 1) * band_rows, packed_samples,
                  sample_places(packed_samples), depth.data(), ids.data(), true});
  return ids;
}

// Whatever is said to be alone in a block is what all its samples show, and what is left out is seen
// at none.
TEST(ScreenTriangles, WhatCoversABlockHidesWhatIsBehind) {
  std::mt19937 random(13);
  std::size_t alone = 0, left_out = 0;
  for (int round = 0; round < 1000; ++round) {
    ScreenTriangles triangles;
    triangles.begin(width, height);
    for (std::uint32_t i = 0; i < 8; ++i)
      triangles.add(any_triangle(random, i == 0 ? 3.0 : 200.0), i, Facing::both);
    const auto ids = shown(triangles, packed_samples, true);
    const int band = round % 2, left = round % 3 * 4;
    const CoveredBlocks blocks = looked_at(triangles, band, left);
    left_out += triangles.pieces() - blocks.shown().size();
    for (int x = left, block = 0; x < width; x += CoveredBlocks::width, ++block) {
      const int end = std::min(x + CoveredBlocks::width, width);
      const auto some = shown_in(triangles, band, blocks, block, x, end);
      const std::uint32_t claimed = blocks.alone(static_cast<std::size_t>(block));
      alone += claimed != no_triangle;
      for (int row = 0; row < band_rows; ++row) {
        const auto length = static_cast<std::size_t>(packed_samples * (end - x));
        const auto* all =
            &ids[static_cast<std::size_t>(packed_samples * ((band * band_rows + row) * width + x))];
        ASSERT_TRUE(std::equal(all, all + length, &some[row * length])) << round;
        if (claimed == no_triangle) continue;
        ASSERT_EQ(std::count(all, all + length, claimed), static_cast<std::ptrdiff_t>(length));
      }
    }
  }
  EXPECT_GT(alone, 200u);
  EXPECT_GT(left_out, 500u);
}

// An edge a thirtieth of a pixel beside the block, or a triangle behind it, changes nothing.
TEST(ScreenTriangles, ABlockIsCoveredUpToItsEdges) {
  const auto add = [](ScreenTriangles& triangles, double right, double depth, std::uint32_t id) {
    triangles.add(corners({-400, -400, depth}, {right, -400, depth}, {right, 400, depth}), id,
                  Facing::both);
  };
  for (const double beside : {0.03, -0.03}) {
    ScreenTriangles triangles;
    triangles.begin(width, height);
    add(triangles, width + 9, 2.0, 0);
    add(triangles, CoveredBlocks::width + beside, 1.0, 1);
    // The first block shows the nearer one alone or both, the second the farther one or both.
    const std::vector<std::uint32_t> expected =
        beside > 0 ? std::vector{1u, no_triangle} : std::vector{no_triangle, 0u};
    const CoveredBlocks blocks = looked_at(triangles, 0, 0);
    EXPECT_EQ((std::vector{blocks.alone(0), blocks.alone(1)}), expected);
  }
}

// A triangle through the eye's plane is drawn where it lies before it, and one behind not at all.
TEST(ScreenTriangles, WhatIsBehindTheEyeIsLeftOut) {
  ScreenTriangles triangles;
  triangles.begin(width, height);
  triangles.add(corners({5, 5, -1}, {30, 8, -2}, {10, 25, -1}), 1, Facing::both);
  EXPECT_EQ(covered(drawn(triangles)), 0u);
  std::array<Corner, 3> through = corners({5, 5, 1}, {35, 5, 1}, {20, 30, 1});
  through[2].pixel = {20.0, 31.0, -1.0};
  triangles.add(through, 2, Facing::both);
  EXPECT_GT(covered(drawn(triangles)), 100u);
}

}  // namespace
}  // namespace polyhull
