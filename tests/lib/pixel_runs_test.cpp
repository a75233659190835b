// SPDX-License-Identifier: LGPL-2.1-or-later
#include "view/pixel_runs.h"

#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace polyhull {
namespace {

struct Seen {
  std::uint32_t number;
  int first;
  std::vector<unsigned> samples;
};

/// The runs of a row whose pixels show so many samples of which triangles.
std::vector<Seen> runs_of(const std::vector<std::vector<std::pair<std::uint32_t, unsigned>>>& row) {
  PixelRuns runs;
  std::vector<Seen> out;
  const auto visit = [&](const PixelRun& run) {
    out.push_back({run.number, run.first, {run.samples, run.samples + run.count}});
    for (int i = 0; i < run.count; ++i)
      EXPECT_FLOAT_EQ(run.weight[i], static_cast<float>(std::popcount(run.samples[i])) / 8.0f);
  };
  for (int x = 0; x < static_cast<int>(row.size()); ++x) {
    runs.finish_before(x, visit);
    for (const auto& [number, samples] : row[static_cast<std::size_t>(x)]) {
      if (samples == 0xff)
        runs.add_whole(number, x, 1);
      else
        runs.add(number, x, samples);
    }
  }
  runs.finish_before(static_cast<int>(row.size()) + 1, visit);
  return out;
}

TEST(PixelRuns, AnEdgeBelongsToBothSides) {
  const auto runs = runs_of({{{1, 0xff}}, {{1, 0x0f}, {2, 0xf0}}, {{2, 0xff}}, {}, {{2, 0xff}}});
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_EQ(runs[0].number, 1u);
  EXPECT_EQ(runs[0].samples, (std::vector<unsigned>{0xff, 0x0f}));
  EXPECT_EQ(runs[1].number, 2u);
  EXPECT_EQ(runs[1].first, 1);
  EXPECT_EQ(runs[1].samples, (std::vector<unsigned>{0xf0, 0xff}));
  EXPECT_EQ(runs[2].first, 4);
}

TEST(PixelRuns, PlacesAreTheSamplesMeans) {
  PixelRuns runs;
  runs.add(3, 0, 0x01);
  runs.add(3, 1, 0x81);
  runs.add_whole(3, 2, 2);
  int visited = 0;
  runs.finish_before(5, [&](const PixelRun& run) {
    ++visited;
    // Of a pixel's sixteenths: the first sample at (9, 5), the last at (15, 1).
    EXPECT_FLOAT_EQ(run.right[0], 1.0f / 16.0f);
    EXPECT_FLOAT_EQ(run.down[0], -3.0f / 16.0f);
    EXPECT_FLOAT_EQ(run.right[1], 4.0f / 16.0f);
    EXPECT_FLOAT_EQ(run.down[1], -5.0f / 16.0f);
    EXPECT_EQ(run.right[2], 0.0f);
    EXPECT_EQ(run.down[3], 0.0f);
    EXPECT_EQ(run.end(), 4);
  });
  EXPECT_EQ(visited, 1);
}

// Eight triangles in every pixel, all of them others in the next, or the same.
TEST(PixelRuns, NothingIsLostOrMixedUp) {
  std::mt19937 random(1);
  std::vector<std::vector<std::pair<std::uint32_t, unsigned>>> row(Span::most);
  std::map<std::pair<int, std::uint32_t>, unsigned> expected;
  for (int x = 0; x < Span::most; ++x) {
    const std::uint32_t base = 8 * static_cast<std::uint32_t>(random() % 3);
    for (unsigned s = 0; s < 8; ++s) {
      row[static_cast<std::size_t>(x)].push_back({base + s, 1u << s});
      expected[{x, base + s}] = 1u << s;
    }
  }
  std::size_t seen = 0;
  for (const Seen& run : runs_of(row)) {
    for (std::size_t i = 0; i < run.samples.size(); ++i, ++seen)
      EXPECT_EQ((expected.at({run.first + static_cast<int>(i), run.number})), run.samples[i]);
    EXPECT_FALSE(expected.contains({run.first - 1, run.number}));
    EXPECT_FALSE(expected.contains({run.first + static_cast<int>(run.samples.size()), run.number}));
  }
  EXPECT_EQ(seen, expected.size());
}

}  // namespace
}  // namespace polyhull
