// SPDX-License-Identifier: LGPL-2.1-or-later
// What HullBuilder allocates from frame to frame of a moving figure: in the steady state nothing
// that grows.
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdio>
#include <vector>

#include "base/thread_pool.h"
#include "hull/build/hull_builder.h"
#include "hull/hull.h"
#include "support/malloc_counter.h"
#include "support/scenes.h"

namespace polyhull::test {
namespace {

constexpr int rounds_walked = 24;

/// What one round over the walk allocates, and what is held after it.
struct Round {
  long allocations;
  std::size_t held;
};

/// Bytes that malloc has given out.
std::size_t held_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// A figure walks and the same pictures come again every six frames. Memory goes from one
/// camera's cone to another's, so it takes some rounds until each piece has met its largest use.
std::vector<Round> walk(const HullOptions& options, bool cameras_come_and_go) {
  std::vector<HullScene> frames;
  for (int i = 0; i < 6; ++i) frames.push_back(figure_scene(6, 16, 0.1 * i));
  HullBuilder builder;
  std::vector<Round> rounds;
  rounds.reserve(rounds_walked);
  std::vector<std::vector<Silhouette>> views;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    views.push_back(frames[i].views());
    if (cameras_come_and_go) views.back().erase(views.back().begin() + (i % 3));
  }
  for (int round = 0; round < rounds_walked; ++round) {
    const MallocCount count = count_mallocs([&] {
      for (const auto& view : views) EXPECT_FALSE(builder.build(view, options).empty());
    });
    rounds.push_back({count.taken, held_bytes()});
  }
  return rounds;
}

/// \p growth: what may be held more, as a share, than half way through.
void expect_steady(const char* what, const std::vector<Round>& rounds, double growth = 0.01) {
  std::printf("%s: allocations in six frames", what);
  for (std::size_t i = 0; i < rounds.size(); i += 5) std::printf(" %ld", rounds[i].allocations);
  std::printf("; MB held");
  for (std::size_t i = 0; i < rounds.size(); i += 5)
    std::printf(" %.3f", double(rounds[i].held) / 1e6);
  std::printf("\n");
  const Round& settled = rounds[rounds.size() / 2];
  for (std::size_t i = rounds.size() / 2 + 1; i < rounds.size(); ++i) {
    EXPECT_LE(double(rounds[i].held), double(settled.held) * (1 + growth))
        << what << ", round " << i;
    EXPECT_LE(rounds[i].allocations, settled.allocations + settled.allocations / 50)
        << what << ", round " << i;
  }
}

TEST(HullAllocations, DoNotGrowFromFrameToFrame) {
  HullOptions options;
  expect_steady("exact", walk(options, false));
  expect_steady("exact, cameras come and go", walk(options, true));
  options.max_deviation = 1e-3;
  expect_steady("simplified", walk(options, false));
}

TEST(HullAllocations, DoNotGrowOnTwoThreads) {
  set_pool_threads(2);
  HullOptions options;
  options.threads = 2;
  // Which thread meets which piece differs from round to round, so both settle later.
  expect_steady("two threads", walk(options, false), 0.05);
  set_pool_threads(0);
}

}  // namespace
}  // namespace polyhull::test
