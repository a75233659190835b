// SPDX-License-Identifier: LGPL-2.1-or-later
// What live timing rests on: how late things come, which frames are wanted, how many can be done.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "live/frame_grid.h"
#include "live/frame_schedule.h"
#include "live/lateness_window.h"
#include "live/pace.h"
#include "live/pace_keeper.h"
#include "live/punctuality.h"

namespace polyhull {
namespace {

constexpr std::int64_t ms = 1'000'000, second = 1000 * ms, frame = 40 * ms;

TEST(LatenessWindow, HoldsTheLargestOfItsSpanAndForgetsIt) {
  LatenessWindow window(16 * second);
  EXPECT_FALSE(window.largest(0));
  window.add(1 * second, 30 * ms);
  window.add(1 * second, 10 * ms);
  window.add(5 * second, 20 * ms);
  EXPECT_EQ(window.largest(5 * second), 30 * ms);
  EXPECT_EQ(window.largest(16 * second), 30 * ms);
  EXPECT_EQ(window.largest(17 * second), 20 * ms);
  EXPECT_FALSE(window.largest(30 * second));
  window.add(31 * second, -5 * ms);
  EXPECT_EQ(window.largest(31 * second), -5 * ms);
  window.reset();
  window.add(31 * second, 7 * ms);
  EXPECT_FALSE(window.largest(2 * second)) << "a clock that was set back";
  EXPECT_EQ(window.largest(31 * second), 7 * ms);
}

TEST(LatenessWindow, WhatIsThereOnceIsNotUsual) {
  LatenessWindow window(16 * second);
  window.add(0, 500 * ms);
  window.add(0, 400 * ms);
  EXPECT_FALSE(window.usually_largest(0));
  window.add(3 * second, 20 * ms);
  window.add(4 * second, 30 * ms);
  EXPECT_EQ(window.largest(4 * second), 500 * ms);
  EXPECT_EQ(window.usually_largest(4 * second), 30 * ms);
  window.add(5 * second, 450 * ms);  // once more: usual
  EXPECT_EQ(window.usually_largest(5 * second), 450 * ms);
  EXPECT_EQ(window.usually_largest(17 * second), 30 * ms);  // the first is forgotten
}

TEST(LatenessWindow, AgreesWithAPlainListToASlot) {
  std::mt19937 random(3);
  LatenessWindow window(8 * second);
  std::vector<std::pair<std::int64_t, std::int64_t>> all;
  for (std::int64_t now = 0; now < 60 * second; now += random() % (400 * ms)) {
    const std::int64_t value = random() % second;
    window.add(now, value);
    all.emplace_back(now, value);
    std::int64_t least = 0, most = 0;
    for (const auto& [time, other] : all) {
      if (time > now - 8 * second) most = std::max(most, other);
      if (time > now - 8 * second + 500 * ms) least = std::max(least, other);
    }
    EXPECT_GE(*window.largest(now), least);
    EXPECT_LE(*window.largest(now), most);
  }
}

TEST(FrameGrid, CamerasApartByLessThanHalfAFrameLeaveOutTheSameInstants) {
  for (const std::int64_t step : {1, 2, 4, 8})
    for (const std::int64_t anchor : {std::int64_t{0}, 7 * frame, 1000 * frame + 3 * ms}) {
      const FrameGrid grid{anchor, frame, step};
      for (int number = -40; number < 40; ++number)
        for (const std::int64_t apart : {-19 * ms, std::int64_t{0}, 19 * ms})
          EXPECT_EQ(grid.wanted(anchor + number * frame + apart), number % step == 0)
              << step << " " << number << " " << apart;
    }
  EXPECT_TRUE((FrameGrid{5, 0, 4}.wanted(123)));
}

TEST(FrameGrids, ChangeAtAnInstantNotWhenTheyHearOfIt) {
  FrameGrids grids;
  grids.change({0, frame, 2}, 10 * frame);
  EXPECT_TRUE(grids.wanted(9 * frame));
  EXPECT_FALSE(grids.wanted(11 * frame));
  grids.change({0, frame, 1}, 20 * frame);
  EXPECT_FALSE(grids.wanted(19 * frame));
  EXPECT_TRUE(grids.wanted(21 * frame));
}

/// Runs a stage that can do \p possible of the stream's frames for \p seconds; returns the share of
/// instants that were lost in the last half.
double share_lost(Pace& pace, double possible, double seconds) {
  double credit = 0.0;
  int wanted = 0, lost = 0;
  const auto frames = static_cast<int>(seconds * 25);
  for (int number = 0; number < frames; ++number) {
    credit = std::min(credit + possible, 1.9);
    if (number % pace.step() != 0) continue;
    const bool done = credit >= 0.999;
    if (done) credit -= 1.0;
    if (number > frames / 2) ++wanted, lost += !done;
    pace.note(number * frame, !done);
  }
  return static_cast<double>(lost) / wanted;
}

TEST(Pace, FindsWhatCanBeDone) {
  for (const auto& [possible, step] :
       {std::pair{1.0, 1}, {0.9, 1}, {0.7, 2}, {0.5, 2}, {0.3, 4}, {0.13, 8}}) {
    Pace pace;
    const double lost = share_lost(pace, possible, 120);
    EXPECT_LT(lost, 0.2) << possible;
    EXPECT_EQ(pace.step(), step) << possible;
  }
}

TEST(Pace, GoesBackWhenTheLoadIsOver) {
  Pace pace;
  std::int64_t number = 0;
  for (; number < 250; ++number) pace.note(number * frame, number % 2 == 0);
  EXPECT_GT(pace.step(), 1);
  for (; number < 250 + 25 * 12; ++number) pace.note(number * frame, false);
  EXPECT_EQ(pace.step(), 1);
}

TEST(Pace, DoesNotJudgeTheFirstSecondOrSingleLosses) {
  Pace pace;
  for (int number = 0; number < 25; ++number) EXPECT_FALSE(pace.note(number * frame, true));
  for (int number = 25; number < 500; ++number)
    EXPECT_FALSE(pace.note(number * frame, number % 20 == 0)) << number;
}

TEST(Punctuality, WhatIsBeyondTheLimitIsNoMeasure) {
  Punctuality input;
  EXPECT_FALSE(input.last_arrival());
  input.set_limit(100 * ms);
  input.note(second, second - 30 * ms);
  input.note(second + frame, second - 300 * ms);
  EXPECT_EQ(input.latest(second + frame), 30 * ms);
  EXPECT_EQ(input.latest_of_all(second + frame), 340 * ms);
  EXPECT_EQ(input.last_arrival(), second + frame);
}

TEST(FrameSchedule, LeavesOutWhatIsLateOrUnwantedAndStaysOnItsGrid) {
  const auto running = [](std::uint64_t number) {
    return static_cast<std::int64_t>(number) * frame;
  };
  FrameSchedule schedule;
  schedule.seek(10 * frame + frame / 2);
  schedule.set_rate(25, 1);
  EXPECT_EQ(schedule.next(INT64_MIN, 0, nullptr, running).number, 11u) << "none that began before";
  schedule.seek(10 * frame + frame / 2);
  EXPECT_EQ(schedule.next(INT64_MIN, 0, nullptr, running).number, 10u) << "the one on show";
  FrameSchedule::Frame late = schedule.next(13 * frame, 0, nullptr, running);
  EXPECT_EQ(late.number, 13u);
  EXPECT_EQ(late.late, 0u) << "nobody has missed what was before the first";
  schedule.finish(late.number);
  late = schedule.next(17 * frame, 0, nullptr, running);
  EXPECT_EQ(late.number, 20u) << "a multiple of four";
  EXPECT_EQ(late.late, 6u);
  EXPECT_EQ(late.time, 20u * frame);
  EXPECT_EQ(late.duration, static_cast<std::uint64_t>(frame));
  FrameGrids grids;
  grids.change({0, frame, 4}, INT64_MIN + 1);
  const FrameSchedule::Frame wanted = schedule.next(INT64_MIN, 0, &grids, running);
  EXPECT_EQ(wanted.number, 16u);
  EXPECT_EQ(wanted.unwanted, 2u);
  schedule.set_rate(50, 1);
  EXPECT_EQ(schedule.next(INT64_MIN, 0, nullptr, running).time, 14u * frame) << "the same time";
}

TEST(PaceKeeper, FollowsTheSparserDecision) {
  PaceKeeper keeper;
  keeper.start();
  std::uint64_t first = 0, later = 0;
  keeper.change(first);
  keeper.hear({{0, frame, 4}, second});
  EXPECT_EQ(keeper.step(), 4u);
  EXPECT_EQ(keeper.change(later).from, second);
  EXPECT_GT(later, first);
  EXPECT_TRUE(keeper.wanted(frame)) << "not before it holds";
  EXPECT_FALSE(keeper.wanted(second + frame));
  // Its own losses ask for less thinning than that, then for more.
  int number = 25;
  for (; keeper.step() == 4 && number < 2000; ++number)
    keeper.note(number * frame, number * frame, frame, true);
  EXPECT_EQ(keeper.step(), 8u);
  EXPECT_TRUE(keeper.thins());
  keeper.hear_earliest(second);
  EXPECT_TRUE(keeper.too_late(second - 1));
  EXPECT_FALSE(keeper.too_late(second));
}

// A decision holds from where sources can still follow it: two frames ahead of all that is on its way, whether
// views come late, or early as from files.
TEST(PaceKeeper, DecidesAheadOfWhatIsOnItsWay) {
  for (const std::int64_t late : {120 * ms, -300 * ms}) {
    PaceKeeper keeper;
    keeper.start();
    std::int64_t time = second, now = 0;
    for (; keeper.step() == 1 && time < 60 * second; time += frame) {
      now = time + late;
      keeper.note(now, time, frame, true);
    }
    time -= frame;  // the last one noted
    ASSERT_EQ(keeper.step(), 2u);
    std::uint64_t version = 0;
    const std::int64_t from = keeper.change(version).from, ahead = std::max(now, time);
    EXPECT_GE(from, ahead + 2 * frame) << late;
    EXPECT_LE(from, ahead + 2 * frame + 200 * ms) << late;
    for (std::int64_t at = time; at < from; at += frame) EXPECT_TRUE(keeper.wanted(at)) << at;
  }
}

TEST(PaceFilter, LeavesOutWhatIsUnwantedOrTooLate) {
  PaceFilter filter;
  EXPECT_TRUE(filter.wanted(second, 100 * second));
  filter.hear({{0, frame, 2}, 0, 100 * ms});
  EXPECT_TRUE(filter.wanted(2 * frame, 2 * frame));
  EXPECT_FALSE(filter.wanted(3 * frame, 3 * frame));
  EXPECT_FALSE(filter.wanted(2 * frame, 2 * frame + 101 * ms));
  EXPECT_TRUE(filter.wanted(INT64_MIN, second)) << "without a time";
}

}  // namespace
}  // namespace polyhull
