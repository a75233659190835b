// SPDX-License-Identifier: LGPL-2.1-or-later
// Clocks that drift, told from delays that change.
#include "mesh/clock_drifts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "mesh/instants.h"

namespace polyhull {
namespace {

constexpr std::int64_t ms = 1'000'000, second = 1000 * ms, frame = 40 * ms;
constexpr std::int64_t boot = 5000 * second;

/// One camera: what its clock has gained and how long its frames take at a time, ns.
struct Line {
  std::function<double(double seconds)> gain = [](double) { return 0.0; };
  std::function<double(double seconds)> delay = [](double) { return 12e6; };
  double found = 0, found_at = 0, worst_at_end = 0;
};

std::function<double(double)> millionths(double drift) {
  return [drift](double seconds) { return 1e3 * drift * seconds; };
}

/// Runs the cameras for so long; delays vary by an exponential of 2 ms beside. What is known of a
/// drift is compared over the last tenth.
void run(std::vector<Line>& lines, double seconds) {
  std::mt19937 random(7);
  std::exponential_distribution<double> late(1.0 / 2e6);
  ClockDrifts drifts;
  const int frames = static_cast<int>(seconds * second / frame);
  for (int i = 0; i < frames; ++i)
    for (Line& line : lines) {
      const double now = 1e-9 * static_cast<double>(i * frame);
      const auto time = boot + i * frame + static_cast<std::int64_t>(line.gain(now));
      const auto arrival = i * frame + static_cast<std::int64_t>(line.delay(now) + late(random));
      if (const double found = drifts.note(&line, time, arrival); found != 0) {
        EXPECT_EQ(line.found, 0) << "told twice";
        line.found = found;
        line.found_at = now;
      }
      if (i > frames * 9 / 10)
        line.worst_at_end =
            std::max(line.worst_at_end,
                     std::abs(line.gain(now) - static_cast<double>(drifts.gained(&line, arrival))));
    }
}

TEST(ClockDrifts, OneIsNamedAndFollowed) {
  for (const double drift : {50.0, -50.0, 200.0}) {
    for (const std::size_t cameras : {2, 3, 4, 8}) {
      std::vector<Line> lines(cameras);
      lines[1].gain = millionths(drift);
      run(lines, 600);
      for (std::size_t c = 0; c < cameras; ++c) {
        if (c != 1) {
          EXPECT_EQ(lines[c].found, 0) << c;
        }
        EXPECT_LT(lines[c].worst_at_end, 0.6e6) << c << " of " << cameras << ", " << drift;
      }
      EXPECT_NEAR(lines[1].found, drift, 0.2 * std::abs(drift));
      EXPECT_LT(lines[1].found_at, 100);
      std::printf("%zu cameras, %.0f ppm: found after %.0f s as %.1f, within %.3f ms at the end\n",
                  cameras, drift, lines[1].found_at, lines[1].found, 1e-6 * lines[1].worst_at_end);
    }
  }
}

TEST(ClockDrifts, SeveralOfManyAreFound) {
  std::vector<Line> lines(5);
  lines[0].gain = millionths(60);
  lines[3].gain = millionths(-40);
  run(lines, 400);
  EXPECT_NEAR(lines[0].found, 60, 12);
  EXPECT_NEAR(lines[3].found, -40, 8);
  for (const Line& line : lines) EXPECT_LT(line.worst_at_end, 0.3e6);
}

// Cameras of one clock beside a machine of another: none drifts against the others.
TEST(ClockDrifts, WhatAllGainIsThisMachinesClock) {
  std::vector<Line> lines(4);
  for (Line& line : lines) line.gain = millionths(80);
  run(lines, 400);
  for (const Line& line : lines) EXPECT_EQ(line.found, 0);
}

TEST(ClockDrifts, DelaysThatChangeAreNoDrift) {
  std::vector<Line> lines(4);
  lines[0].delay = [](double seconds) { return seconds < 100 ? 12e6 : 22e6; };
  lines[1].delay = [](double seconds) { return 12e6 + 8e6 * std::sin(seconds / 7.0); };
  lines[2].delay = [](double seconds) { return 12e6 + 30e6 * std::exp(-seconds / 5.0); };
  run(lines, 500);
  for (const Line& line : lines) {
    EXPECT_EQ(line.found, 0);
    EXPECT_EQ(line.worst_at_end, 0);
  }
}

TEST(ClockDrifts, AClockThatIsSetRightMeanwhileStaysWhereItIs) {
  std::vector<Line> lines(3);
  lines[2].gain = [](double seconds) { return 50e3 * std::min(seconds, 300.0); };
  run(lines, 700);
  EXPECT_NE(lines[2].found, 0);
  EXPECT_LT(lines[2].worst_at_end, 0.5e6);
}

TEST(ClockDrifts, InstantsPlaceItsViewsByTheOthers) {
  const int cameras[2] = {};
  Instants instants;
  int told = 0;
  for (int i = 0; i < 25 * 600; ++i)
    for (int c = 0; c < 2; ++c) {
      const std::int64_t taken = i * frame, gained = c == 1 ? taken / 20'000 : 0;  // 50 ppm
      const std::int64_t running = taken + 12 * ms + (i * 7 + c * 3) % 5 * ms;
      const ArrivalTimes now{777 * second + running, boot, running, 0, true};
      const auto placed = instants.place(
          &cameras[c], {running, boot + taken + gained, CaptureClock::pipeline, no_time}, now);
      if (placed.drift != 0) {
        ++told;
        EXPECT_EQ(c, 1);
        EXPECT_NEAR(placed.drift, 50, 5);
      }
      const bool settled = c == 0 || i > 25 * 100;
      EXPECT_NEAR(static_cast<double>(placed.time), static_cast<double>(taken),
                  settled ? 0.5e6 : 5e6)
          << i;
    }
  EXPECT_EQ(told, 1);
}

}  // namespace
}  // namespace polyhull
