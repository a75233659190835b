// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/adaptive_tolerance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace polyhull {
namespace {

constexpr std::int64_t second = 1'000'000'000;

/// A chain whose load falls with the square root of the tolerance, observed 30 times a second.
struct Chain {
  double load_at_base;
  double fixed_share = 0.0;  // of the load that the tolerance does not change
  double noise = 0.0;
  std::mt19937 random{7};

  double load(double tolerance) {
    std::normal_distribution<double> normal(0.0, noise);
    const double falling = load_at_base * (1.0 - fixed_share) / std::sqrt(tolerance);
    return std::max(0.01, (load_at_base * fixed_share + falling) * (1.0 + normal(random)));
  }
};

struct Outcome {
  int changes = 0;       // in the last two thirds of the time
  double mean_load = 0;  // there
};

Outcome simulate(AdaptiveTolerance& control, Chain chain, int seconds, std::int64_t from = 0) {
  Outcome outcome;
  int measured = 0;
  for (int i = 0; i < seconds * 30; ++i) {
    const int before = control.level();
    const double load = chain.load(control.tolerance(1.0));
    control.observe(load, from + i * second / 30);
    if (i < seconds * 10) continue;
    outcome.changes += control.level() != before;
    outcome.mean_load += load;
    ++measured;
  }
  outcome.mean_load /= measured;
  return outcome;
}

TEST(AdaptiveTolerance, StaysAtTheBaseWhenThereIsTime) {
  AdaptiveTolerance control;
  const Outcome outcome = simulate(control, Chain{0.8, 0.0, 0.1}, 60);
  EXPECT_EQ(control.level(), 0);
  EXPECT_EQ(outcome.changes, 0);
  EXPECT_EQ(control.tolerance(1.5), 1.5);
}

TEST(AdaptiveTolerance, CoarsensUntilTheRateIsHeldAndStaysThere) {
  for (const double load : {1.2, 1.7, 2.5, 3.5}) {
    AdaptiveTolerance control;
    const Outcome outcome = simulate(control, Chain{load, 0.0, 0.15}, 300);
    EXPECT_LE(outcome.mean_load, 1.02) << load;
    EXPECT_GT(outcome.mean_load, 0.6) << load << ": coarser than needed";
    EXPECT_LE(outcome.changes, 10) << load << ": oscillates";
  }
}

TEST(AdaptiveTolerance, RefinesAgainWhenTheLoadFalls) {
  AdaptiveTolerance control;
  simulate(control, Chain{3.0, 0.0, 0.1}, 30);
  EXPECT_GE(control.level(), 5);
  simulate(control, Chain{0.4, 0.0, 0.1}, 120, 30 * second);
  EXPECT_EQ(control.level(), 0);
}

TEST(AdaptiveTolerance, AStepDownThatFailedIsTriedMoreAndMoreSeldom) {
  // The load jumps from well below to above between two levels: no level is right.
  AdaptiveTolerance control;
  int changes = 0;
  for (int i = 0; i < 600 * 30; ++i) {
    const int before = control.level();
    control.observe(control.level() >= 3 ? 0.5 : 1.3, i * second / 30);
    changes += control.level() != before;
  }
  EXPECT_LE(changes, 30);
  EXPECT_GE(control.level(), 2);
}

// Between 0.7 and 1 there is neither too little time nor enough for a finer level.
TEST(AdaptiveTolerance, BetweenTheLimitsItStays) {
  for (const auto& [load, stays] : {std::pair{0.98, true}, {0.72, true}, {0.68, false}}) {
    AdaptiveTolerance control;
    std::int64_t time = 0;
    const auto observe = [&](double seen, int seconds) {
      for (int i = 0; i < 30 * seconds; ++i, time += second / 30) control.observe(seen, time);
    };
    observe(1.5, 3);
    observe(load, 1);  // the last half second has seen both
    const int level = control.level();
    EXPECT_GE(level, 2);
    observe(load, 100);
    if (stays) {
      EXPECT_EQ(control.level(), level) << load;
    } else {
      EXPECT_EQ(control.level(), 0) << load;
    }
  }
  // 1.02 is too little.
  AdaptiveTolerance control;
  for (int i = 0; i < 60; ++i) control.observe(1.02, i * second / 30);
  EXPECT_GE(control.level(), 1);
}

TEST(AdaptiveTolerance, EndsAtTheHighestLevel) {
  AdaptiveTolerance control;
  simulate(control, Chain{100.0, 0.9, 0.0}, 60);
  EXPECT_EQ(control.level(), AdaptiveTolerance::highest_level);
  EXPECT_DOUBLE_EQ(control.tolerance(0.5), 8.0);
  control.reset();
  EXPECT_EQ(control.level(), 0);
}

TEST(AdaptiveTolerance, IgnoresWhatIsNoLoad) {
  AdaptiveTolerance control;
  for (int i = 0; i < 300; ++i) {
    control.observe(std::numeric_limits<double>::quiet_NaN(), i * second);
    control.observe(std::numeric_limits<double>::infinity(), i * second);
    control.observe(-3.0, i * second);
    control.observe(0.0, i * second);
  }
  EXPECT_EQ(control.level(), 0);
}

TEST(AdaptiveTolerance, TimeThatJumpsBackBeginsANewWindow) {
  AdaptiveTolerance control;
  control.observe(5.0, 100 * second);
  control.observe(0.9, 0);
  control.observe(0.9, second);
  EXPECT_EQ(control.level(), 0);
}

}  // namespace
}  // namespace polyhull
