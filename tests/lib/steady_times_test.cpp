// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/steady_times.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace polyhull {
namespace {

constexpr std::int64_t ms = 1'000'000, frame = 40 * ms;

/// A camera whose clock began at `offset` and runs faster by `drift`; frames come 12 ms after they
/// were taken, and up to 30 ms later, as chance will have it.
struct Line {
  explicit Line(double drift) : drift(drift) {}
  std::int64_t camera(int i) const {
    return static_cast<std::int64_t>(static_cast<double>(i * frame) * (1.0 + drift));
  }
  std::int64_t taken(int i) const { return 5'000 * ms + i * frame; }
  std::int64_t arrival(int i) {
    return taken(i) + 12 * ms +
           (held(chance) < 0.5 ? 0 : static_cast<std::int64_t>(held(chance) * 30 * ms));
  }
  double drift;
  std::mt19937 chance{7};
  std::uniform_real_distribution<double> held{0.0, 1.0};
};

TEST(SteadyTimes, FramesAreAsFarApartAsTheyWereTaken) {
  for (const double drift : {0.0, 5e-5, -5e-5}) {
    Line line(drift);
    SteadyTimes times;
    int placed = 0;
    for (int i = 0; i < 25 * 600; ++i) {
      const std::int64_t arrival = line.arrival(i);
      const auto found = times.place(line.camera(i), arrival, {});
      EXPECT_EQ(found.has_value(), line.camera(i) >= 500 * ms) << i;
      if (!found) continue;
      ++placed;
      EXPECT_LE(found->time, arrival);
      EXPECT_EQ(found->time + found->held_up, arrival);
      // Of the first second's frames half came without being held up.
      ASSERT_LT(std::abs(found->time - 12 * ms - line.taken(i)), ms / 4)
          << i << ", drift " << drift;
    }
    EXPECT_GT(placed, 25 * 599);
    EXPECT_EQ(times.restarts(), 0u);
  }
}

TEST(SteadyTimes, AStallIsNoNewClock) {
  SteadyTimes times;
  std::optional<SteadyTimes::Placed> found;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t taken = i * frame;
    // Frames 50 to 74 come together, a second late.
    const std::int64_t arrival = (i >= 50 && i < 75 ? 75 * frame : taken) + 10 * ms;
    found = times.place(taken, arrival, {});
    if (i >= 50) {
      ASSERT_TRUE(found);
      EXPECT_LT(std::abs(found->time - taken - 10 * ms), ms) << i;
    }
  }
  EXPECT_EQ(times.restarts(), 0u);
  EXPECT_LT(times.delay(), 11 * ms);
}

// The receiver's clock is set forward, or the camera's back: no frame will come sooner again.
TEST(SteadyTimes, AStepThatLastsIsANewClock) {
  SteadyTimes times;
  for (int i = 0; i < 50; ++i) times.place(i * frame, i * frame + 10 * ms, {});
  for (int i = 50; i < 400; ++i) {
    const std::int64_t arrival = i * frame + 2'000 * ms + (10 + i % 7) * ms;
    const auto found = times.place(i * frame, arrival, {});
    ASSERT_TRUE(found);
    EXPECT_LE(found->time, arrival);
    if (i > 50 + 251) {
      EXPECT_LT(found->held_up, 7 * ms) << i;
    }
  }
  EXPECT_EQ(times.restarts(), 1u);
  // Five seconds' frames that come at once are no clock, however long the stall was.
  for (int i = 400; i < 525; ++i) times.place(i * frame, 525 * frame + 2'010 * ms, {});
  EXPECT_EQ(times.restarts(), 1u);
  EXPECT_LT(times.delay(), 2'012 * ms);
  // A smaller step where it is asked for.
  for (int i = 525; i < 825; ++i)
    times.place(i * frame, i * frame + 2'510 * ms, {.step = 200 * ms});
  EXPECT_EQ(times.restarts(), 2u);
  EXPECT_EQ(times.delay(), 2'510 * ms);
}

// Frames that are late, then none, then all that is left at once; and a camera that is slower than any
// stall.
TEST(SteadyTimes, LateFramesWithGapsAreNoNewClock) {
  SteadyTimes times;
  for (int i = 0; i < 500; ++i) {
    std::int64_t arrival = i * frame + 10 * ms;
    if (i >= 80 && i < 140) arrival = i * frame + 1'500 * ms;
    if (i >= 140 && i < 380) arrival = 380 * frame + 10 * ms;
    times.place(i * frame, arrival, {});
  }
  EXPECT_EQ(times.restarts(), 0u);
  EXPECT_LT(times.delay(), 12 * ms);
  SteadyTimes slow;
  for (int i = 0; i < 60; ++i)
    slow.place(i * 4'000 * ms, i * 4'000 * ms + (i >= 30 && i < 36 ? 1'100 * ms : 10 * ms), {});
  EXPECT_EQ(slow.restarts(), 0u);
}

// A clock that was set is found on a way that hiccups.
TEST(SteadyTimes, AStepIsFoundAmongHiccups) {
  SteadyTimes times;
  for (int i = 0; i < 500; ++i) {
    const std::int64_t late = i < 50 ? 10 * ms : i % 125 < 5 ? 460 * ms : 310 * ms;
    times.place(i * frame, i * frame + late, {.step = 100 * ms});
  }
  EXPECT_EQ(times.restarts(), 1u);
  EXPECT_LT(times.delay(), 312 * ms);
  EXPECT_GE(times.delay(), 310 * ms);
}

TEST(SteadyTimes, ACameraThatStartsAgainIsLearnedAnew) {
  SteadyTimes times;
  for (int i = 0; i < 50; ++i) times.place(i * frame, 9'000 * ms + i * frame, {});
  EXPECT_EQ(times.delay(), 9'000 * ms);
  // From 0 on again, three seconds later.
  EXPECT_FALSE(times.place(0, 14'000 * ms, {}));
  EXPECT_EQ(times.restarts(), 1u);
  std::optional<SteadyTimes::Placed> found;
  for (int i = 1; i < 50; ++i) found = times.place(i * frame, 14'000 * ms + i * frame, {});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->time, 14'000 * ms + 49 * frame);
  // Its clock is set forward by an hour, and back.
  EXPECT_FALSE(times.place(3'600'000 * ms, 14'000 * ms + 50 * frame, {}));
  EXPECT_FALSE(times.place(51 * frame, 14'000 * ms + 51 * frame, {}));
  EXPECT_EQ(times.restarts(), 3u);
  times.reset();
  EXPECT_EQ(times.delay(), 0);
  EXPECT_EQ(times.restarts(), 3u);
  EXPECT_TRUE(times.place(0, 5 * ms, {0, 0.0}));
}

}  // namespace
}  // namespace polyhull
