// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames and their pulses, matched by time: lost, late, repeated and stray frames, and pulses that
// were never given.
#include <gtest/gtest.h>

#include <random>

#include "trigger/frame_matcher.h"
#include "trigger/jitter.h"

using namespace polyhull;
using Kind = FrameMatcher::Kind;

namespace {

constexpr std::int64_t ms = 1000000;
constexpr std::int64_t period = 16666667;

/// Pulse n at 1 s + n periods.
std::int64_t time_of(std::uint64_t n) {
  return 1000 * ms + static_cast<std::int64_t>(n) * period;
}

class TriggerTest : public ::testing::Test {
 protected:
  void give(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i, ++given) table.add({given, time_of(given), 0});
  }
  FrameMatcher::Match match(std::int64_t time) { return matcher.match(table, time, settings); }
  void expect(std::int64_t time, Kind kind, std::uint64_t number = 0) {
    const FrameMatcher::Match found = match(time);
    EXPECT_EQ(found.kind, kind) << "at " << time;
    if (kind == Kind::numbered || kind == Kind::repeated) {
      EXPECT_EQ(found.number, number);
    }
  }

  PulseTable table;
  FrameMatcher matcher{table};
  FrameMatchSettings settings{5 * ms, 3 * ms};
  std::uint64_t given = 0;
};

}  // namespace

TEST_F(TriggerTest, WindowsIncludeTheirEnds) {
  give(3);
  expect(time_of(0) + 5 * ms - 1, Kind::unexplained);
  expect(time_of(0) + 5 * ms, Kind::numbered, 0);
  expect(time_of(1) + 8 * ms, Kind::numbered, 1);
  expect(time_of(2) + 8 * ms + 1, Kind::unexplained);
  EXPECT_EQ(matcher.unanswered(), 1u);  // pulse 2: its window is over
}

TEST_F(TriggerTest, LostFramesShiftNothing) {
  give(1000);
  std::mt19937 random(7);
  std::uint64_t lost = 0;
  for (std::uint64_t n = 0; n < 1000; ++n) {
    if (n < 999 && random() % 3 == 0) {
      ++lost;
      continue;
    }
    expect(time_of(n) + 5 * ms + static_cast<std::int64_t>(random() % (3 * ms)), Kind::numbered, n);
  }
  EXPECT_EQ(matcher.unanswered(), lost);
}

TEST_F(TriggerTest, DelaysLongerThanThePeriod) {
  settings.delay = 100 * ms;
  give(100);  // all are given before the first frame is there
  for (std::uint64_t n = 0; n < 100; ++n) expect(time_of(n) + 101 * ms, Kind::numbered, n);
  EXPECT_EQ(matcher.unanswered(), 0u);
}

TEST_F(TriggerTest, ASecondFrameOfAPulseGetsNoNumber) {
  give(2);
  expect(time_of(0) + 5 * ms, Kind::numbered, 0);
  expect(time_of(0) + 6 * ms, Kind::repeated, 0);
  expect(time_of(1) + 5 * ms, Kind::numbered, 1);
  expect(time_of(0) + 7 * ms, Kind::unexplained);  // out of order
  expect(time_of(1) + 6 * ms, Kind::repeated, 1);
  EXPECT_EQ(matcher.unanswered(), 0u);
}

TEST_F(TriggerTest, StrayFramesGetNoNumberAndTakeNone) {
  give(3);
  expect(time_of(0) - 500 * ms, Kind::unexplained);
  EXPECT_LT(match(time_of(0) - 500 * ms).after, 0);
  expect(time_of(0) + 2 * ms, Kind::unexplained);
  expect(time_of(0) + 6 * ms, Kind::numbered, 0);
  const FrameMatcher::Match stray = match(time_of(1) + 9 * ms);
  EXPECT_EQ(stray.kind, Kind::unexplained);
  EXPECT_EQ(stray.after, 9 * ms);
  expect(time_of(2) + 6 * ms, Kind::numbered, 2);
  expect(time_of(2) + 5000 * ms, Kind::unexplained);
  EXPECT_EQ(matcher.unanswered(), 1u);
}

TEST_F(TriggerTest, WindowsThatOverlapExplainNothing) {
  settings = {0, 20 * ms};
  give(10);
  expect(time_of(5) + 1 * ms, Kind::ambiguous);
  expect(time_of(5) + 18 * ms, Kind::ambiguous);
  expect(time_of(5) + 10 * ms, Kind::numbered, 5);
  EXPECT_EQ(matcher.unanswered(), 5u);
}

TEST_F(TriggerTest, APulseTakenBackHasNoFrame) {
  give(2);
  table.withdraw();
  expect(time_of(0) + 6 * ms, Kind::numbered, 0);
  expect(time_of(1) + 6 * ms, Kind::unexplained);
  table.add({1, time_of(4), 0});  // its number is given to the next
  expect(time_of(4) + 6 * ms, Kind::numbered, 1);
  EXPECT_EQ(matcher.unanswered(), 0u);
}

TEST_F(TriggerTest, NumbersThatStartAnew) {
  give(10);
  expect(time_of(9) + 6 * ms, Kind::numbered, 9);
  EXPECT_EQ(matcher.unanswered(), 9u);
  table.begin_round();
  table.add({0, time_of(20), 0});
  table.add({1, time_of(21), 0});
  expect(time_of(9) + 7 * ms, Kind::unexplained);
  expect(time_of(21) + 6 * ms, Kind::numbered, 1);
  EXPECT_EQ(matcher.unanswered(), 10u);
}

TEST_F(TriggerTest, ACameraBeginsWithTheNextPulse) {
  give(5);
  FrameMatcher late(table);
  EXPECT_EQ(late.match(table, time_of(4) + 6 * ms, settings).kind, Kind::unexplained);
  give(2);
  EXPECT_EQ(late.match(table, time_of(6) + 6 * ms, settings).number, 6u);
  EXPECT_EQ(late.unanswered(), 1u);
}

TEST_F(TriggerTest, ASilentCamerasPulsesAreCounted) {
  give(10);
  const std::int64_t patience = 1000 * ms;
  // The window of pulse 3 is over for exactly the patience, that of pulse 2 for longer.
  const std::int64_t now = time_of(3) + 8 * ms + patience;
  EXPECT_EQ(matcher.unanswered(table, now, patience, settings), 3u);
  EXPECT_EQ(matcher.unanswered(table, now + 1, patience, settings), 4u);
  EXPECT_EQ(matcher.unanswered(table, now + 5000 * ms, patience, settings), 10u);
  EXPECT_EQ(matcher.unanswered(), 0u);
  expect(time_of(1) + 6 * ms, Kind::numbered, 1);  // asking has changed nothing
  EXPECT_EQ(matcher.unanswered(table, now, patience, settings), 2u);
}

TEST_F(TriggerTest, PulsesThatAreForgottenAreCounted) {
  give(PulseTable::capacity + 100);
  expect(time_of(99) + 6 * ms, Kind::unexplained);
  expect(time_of(100) + 6 * ms, Kind::numbered, 100);
  EXPECT_EQ(matcher.unanswered(), 100u);
}

TEST(JitterTest, Percentile) {
  Jitter jitter;
  EXPECT_EQ(jitter.p99(), 0.0);
  jitter.add(-5000);
  EXPECT_EQ(jitter.p99(), 5.0);
  for (int i = 1; i <= 100; ++i) jitter.add(i * 1000);
  for (int i = 0; i < 899; ++i) jitter.add(0);
  // The last 1000: 5, 1 to 100 and zeros; ten are larger than 90.
  EXPECT_EQ(jitter.p99(), 90.0);
  for (int i = 0; i < 950; ++i) jitter.add(7000);
  EXPECT_EQ(jitter.p99(), 7.0);
  EXPECT_EQ(jitter.largest(), 100.0);
}
