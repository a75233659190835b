// SPDX-License-Identifier: LGPL-2.1-or-later
// The table of docs/elements/hullbuild: what becomes of missing, late, duplicate and out-of-order
// views.
#include "mesh/view_sets.h"

#include <gtest/gtest.h>

#include <random>

namespace polyhull {
namespace {

using Kind = ViewDecision::Kind;
using Indices = std::vector<std::size_t>;

constexpr std::int64_t ms = 1000000;
constexpr std::int64_t tolerance = 5 * ms;

ViewHead view(std::uint64_t trigger, std::int64_t time, bool repeated = false) {
  return {ViewHead::State::view, trigger, time, no_time, repeated};
}
ViewHead timed(std::int64_t time) {
  return view(no_trigger, time);
}
ViewHead waiting() {
  return {};
}
ViewHead ended() {
  return {ViewHead::State::ended, no_trigger, no_time, no_time, false};
}
ViewHead gap(std::int64_t from, std::int64_t to) {
  return {ViewHead::State::gap, no_trigger, from, to, false};
}

void expect(ViewSets& sets, std::vector<ViewHead> heads, Kind kind, Indices indices = {},
            bool deadline = false) {
  const ViewDecision decision = sets.next(heads, tolerance, deadline);
  EXPECT_EQ(decision.kind, kind);
  EXPECT_EQ(decision.heads, indices);
}

TEST(ViewSets, TriggerNumbersDecideWhateverTheTimes) {
  ViewSets sets;
  expect(sets, {view(7, 100 * ms), view(7, 180 * ms), view(7, 90 * ms)}, Kind::set, {0, 1, 2});
  expect(sets, {view(9, 200 * ms), view(8, 201 * ms), view(8, 200 * ms)}, Kind::set, {1, 2});
  expect(sets, {view(9, 200 * ms), view(9, 260 * ms), view(9, 250 * ms)}, Kind::set, {0, 1, 2});
}

TEST(ViewSets, TimesWithinTheToleranceBelongTogether) {
  ViewSets sets;
  expect(sets, {timed(100 * ms), timed(105 * ms), timed(103 * ms)}, Kind::set, {0, 1, 2});
  expect(sets, {timed(140 * ms), timed(146 * ms), timed(141 * ms)}, Kind::set, {0, 2});
  expect(sets, {timed(180 * ms), timed(146 * ms), timed(180 * ms)}, Kind::set, {1});
}

TEST(ViewSets, OneWithoutNumberMakesTimeDecide) {
  ViewSets sets;
  expect(sets, {view(7, 100 * ms), timed(101 * ms), view(8, 101 * ms)}, Kind::set, {0, 1});
}

TEST(ViewSets, WithoutNumbersAndTimesArrivalDecides) {
  ViewSets sets;
  expect(sets, {timed(no_time), timed(no_time)}, Kind::set, {0, 1});
  expect(sets, {timed(no_time), timed(no_time)}, Kind::set, {0, 1});
}

TEST(ViewSets, WaitsUntilTheDeadline) {
  ViewSets sets;
  expect(sets, {view(1, 0), waiting()}, Kind::wait);
  expect(sets, {view(1, 0), waiting()}, Kind::set, {0}, true);
  expect(sets, {waiting(), waiting()}, Kind::wait, {}, true);
  expect(sets, {}, Kind::wait, {}, true);
}

TEST(ViewSets, LateAndOutOfOrderViewsAreDropped) {
  ViewSets sets;
  expect(sets, {view(5, 100 * ms), waiting()}, Kind::set, {0}, true);
  expect(sets, {view(6, 140 * ms), view(5, 100 * ms)}, Kind::drop_late, {1});
  expect(sets, {view(6, 140 * ms), view(3, 60 * ms)}, Kind::drop_late, {1});
  expect(sets, {view(6, 140 * ms), view(6, 140 * ms)}, Kind::set, {0, 1});
  sets.reset();
  expect(sets, {timed(100 * ms), waiting()}, Kind::set, {0}, true);
  expect(sets, {timed(140 * ms), timed(104 * ms)}, Kind::drop_late, {1});
  expect(sets, {timed(140 * ms), timed(141 * ms)}, Kind::set, {0, 1});
}

TEST(ViewSets, DuplicatesAreToldFromLateOnes) {
  ViewSets sets;
  expect(sets, {view(5, 100 * ms), view(5, 100 * ms)}, Kind::set, {0, 1});
  expect(sets, {view(5, 100 * ms, true), view(6, 140 * ms)}, Kind::drop_duplicate, {0});
}

TEST(ViewSets, NumbersThatStartAgain) {
  ViewSets sets;
  expect(sets, {view(104, 1000 * ms), view(104, 1000 * ms), view(104, 1000 * ms)}, Kind::set,
         {0, 1, 2});
  // Camera 2 still has one view of the old count.
  expect(sets, {view(0, 1100 * ms), view(0, 1100 * ms), view(105, 1040 * ms)}, Kind::set, {2});
  expect(sets, {view(0, 1100 * ms), view(0, 1100 * ms), view(0, 1101 * ms)}, Kind::set, {0, 1, 2});
  expect(sets, {view(1, 1140 * ms), view(1, 1140 * ms), view(1, 1141 * ms)}, Kind::set, {0, 1, 2});
}

TEST(ViewSets, GapsTellThatACameraHasNothing) {
  ViewSets sets;
  expect(sets, {timed(100 * ms), gap(90 * ms, 150 * ms)}, Kind::set, {0});
  expect(sets, {timed(150 * ms), gap(90 * ms, 150 * ms)}, Kind::drop_gaps, {1});
  // A gap alone is kept while a view may come that it speaks about, up to the deadline.
  expect(sets, {waiting(), gap(150 * ms, 190 * ms)}, Kind::wait);
  expect(sets, {waiting(), gap(150 * ms, 190 * ms)}, Kind::drop_gaps, {1}, true);
}

// The camera that is behind may have views yet for the time of the others' gaps: dropping those
// would make it wait for cameras that said they had nothing.
TEST(ViewSets, OfGapsAloneTheFirstToEndGoes) {
  ViewSets sets;
  expect(sets, {gap(0, 40 * ms), gap(200 * ms, 240 * ms), gap(240 * ms, 280 * ms)}, Kind::drop_gaps,
         {0});
  expect(sets, {waiting(), gap(200 * ms, 240 * ms), gap(240 * ms, 280 * ms)}, Kind::wait);
  expect(sets, {timed(210 * ms), gap(200 * ms, 240 * ms), gap(240 * ms, 280 * ms)}, Kind::set, {0});
  expect(sets, {ended(), gap(200 * ms, 240 * ms), gap(200 * ms, 240 * ms)}, Kind::drop_gaps,
         {1, 2});
  expect(sets, {gap(200 * ms, 240 * ms), gap(no_time, no_time), gap(240 * ms, 280 * ms)},
         Kind::drop_gaps, {1});
  expect(sets, {waiting(), gap(no_time, no_time)}, Kind::drop_gaps, {1});
  expect(sets, {ended(), ended(), ended()}, Kind::end);
}

TEST(ViewSets, EndedCamerasAreNotWaitedFor) {
  ViewSets sets;
  expect(sets, {timed(100 * ms), ended()}, Kind::set, {0});
  expect(sets, {waiting(), ended()}, Kind::wait);
  expect(sets, {ended(), ended()}, Kind::end);
}

// Whatever comes, no view is in two sets, none joins a set of another instant, and it ends.
TEST(ViewSets, RandomStreams) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    const bool numbered = round % 2;
    std::vector<std::vector<ViewHead>> queues(1 + random() % 5);
    for (auto& queue : queues)
      for (int frame = 0; frame < 40; ++frame) {
        const std::int64_t time =
            frame * 40 * ms + static_cast<std::int64_t>(random() % (4 * ms / 1000)) * 1000;
        if (random() % 8 == 0) continue;  // missing
        queue.push_back(view(numbered ? frame : no_trigger, time));
        if (random() % 16 == 0) queue.push_back(view(numbered ? frame : no_trigger, time, true));
        if (random() % 16 == 0 && queue.size() > 1)
          std::swap(queue.back(), queue[queue.size() - 2]);
      }
    ViewSets sets;
    std::vector<std::size_t> at(queues.size(), 0);
    std::int64_t last_time = -1;
    int steps = 0;
    for (;; ++steps) {
      ASSERT_LT(steps, 2000);
      std::vector<ViewHead> heads;
      for (std::size_t i = 0; i < queues.size(); ++i)
        heads.push_back(at[i] < queues[i].size() ? queues[i][at[i]] : ended());
      const ViewDecision decision = sets.next(heads, tolerance, random() % 2);
      if (decision.kind == Kind::end) break;
      ASSERT_FALSE(decision.heads.empty());
      if (decision.kind == Kind::set) {
        ASSERT_GT(decision.time, last_time);
        last_time = decision.time;
        for (const std::size_t i : decision.heads) {
          ASSERT_EQ(heads[i].trigger, decision.trigger);
          ASSERT_EQ(heads[i].time / (40 * ms), decision.time / (40 * ms));
        }
      }
      for (const std::size_t i : decision.heads) ++at[i];
    }
  }
}

}  // namespace
}  // namespace polyhull
