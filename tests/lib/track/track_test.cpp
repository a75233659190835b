// SPDX-License-Identifier: LGPL-2.1-or-later
// Poses between those that arrive: interpolation, smoothing's lag, prediction, loss, two senders.
#include "track/track.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "base/error.h"
#include "packets.h"
#include "track/pose_reader.h"

namespace polyhull {
namespace {

constexpr std::int64_t ms = 1'000'000;

TrackedPose pose_at(double x, double pan = 0.0) {
  TrackedPose pose;
  pose.source = "a";
  pose.place.x = x;
  pose.axes = axes_of_angles(pan, 0, 0);
  return pose;
}

// 1 m and 10° a second, 50 poses a second, for 1 s.
Track moving(TrackSettings settings) {
  Track track(std::move(settings));
  for (int i = 0; i <= 50; ++i) track.add(pose_at(0.02 * i, 0.2 * i), 20 * ms * i);
  return track;
}

void expect_at(const Track& track, std::int64_t time, double seconds) {
  const auto pose = track.at(time);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->place.x, seconds, 1e-9);
  const Mat3 truth = axes_of_angles(10 * seconds, 0, 0);
  for (int k = 0; k < 3; ++k) EXPECT_LE(glm::length(pose->axes[k] - truth[k]), 1e-7);
}

TEST(Track, LiesBetweenPosesAndStandsAfterTheLast) {
  const Track track = moving({});
  EXPECT_FALSE(track.at(-1));
  expect_at(track, 0, 0.0);
  expect_at(track, 507 * ms, 0.507);
  expect_at(track, 5000 * ms, 1.0);
  EXPECT_FALSE(Track({}).at(0));
}

// Heads turn beyond 180 degrees; senders count on or begin again at -180.
TEST(Track, PansThroughHalfATurnWithoutAJump) {
  for (const bool wraps : {false, true})
    for (const std::int64_t smoothing : {0 * ms, 100 * ms}) {
      TrackSettings settings;
      settings.smoothing_ns = smoothing;
      Track track(settings);
      const auto pan_at = [](double time) { return 170.0 + 4.0 * time / (20.0 * ms); };
      for (int i = 0; i <= 20; ++i) {
        const double pan = pan_at(20.0 * ms * i);
        const auto packet = track_examples::freed(
            1, {wraps && pan > 180.0 ? pan - 360.0 : pan, 0, 0}, Vec3(0.0), 0, 0);
        track.add(pose_of(parse_freed(packet), {}), 20 * ms * i);
      }
      for (std::int64_t time = 100 * ms; time < 400 * ms; time += 3 * ms) {
        const Mat3 truth = axes_of_angles(-pan_at(static_cast<double>(time - smoothing / 2)), 0, 0);
        for (int k = 0; k < 3; ++k)
          EXPECT_LE(glm::length(track.at(time)->axes[k] - truth[k]), 1e-6) << time;
      }
    }
}

TEST(Track, DelaySmoothingAndPredictionShiftAsTheySay) {
  TrackSettings settings;
  settings.delay_ns = 40 * ms;
  expect_at(moving(settings), 460 * ms, 0.5);
  settings.delay_ns = 0;
  settings.smoothing_ns = 100 * ms;
  const Track smooth = moving(settings);
  EXPECT_EQ(smooth.lag_ns(), 50 * ms);
  expect_at(smooth, 507 * ms, 0.457);
  settings.smoothing_ns = 0;
  settings.prediction_ns = 30 * ms;
  const Track predicted = moving(settings);
  expect_at(predicted, 1015 * ms, 1.015);
  expect_at(predicted, 2000 * ms, 1.03);
  settings.prediction_ns = -1;
  EXPECT_THROW(Track{settings}, Error);
}

// Five poses at a time, as a switch's queue or a late wake-up of the receiver makes of 50 a second.
TEST(Track, PredictionIsNotThrownByPosesThatComeTogether) {
  TrackSettings settings;
  settings.prediction_ns = 40 * ms;
  Track track(settings);
  double furthest = 0;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t arrival = 100 * ms * (i / 5) + 20'000 * (i % 5);
    track.add(pose_at(0.01 * i), arrival);
    const auto pose = track.at(arrival + 40 * ms);
    furthest = std::max(furthest, std::abs(pose->place.x - 0.01 * i));
  }
  // .5 m/s for 40 ms, and what is not even in the arrivals; 20 m by the last two alone.
  EXPECT_LT(furthest, 0.05);
  // Sent twice, it moves on.
  track.add(pose_at(1.0), 2001 * ms);
  track.add(pose_at(1.0), 2001 * ms + 30'000);
  EXPECT_GT(track.at(2041 * ms)->place.x, 1.003);
}

// Nothing is known of the motion before a silence, nor of one that has only begun.
TEST(Track, PredictionGoesNoFurtherThanWasSeen) {
  TrackSettings settings;
  settings.prediction_ns = 100 * ms;
  Track track(settings);
  track.add(pose_at(0.0), 0);
  EXPECT_EQ(track.at(500 * ms)->place.x, 0.0);
  track.add(pose_at(5.0), 3000 * ms);
  EXPECT_EQ(track.at(3050 * ms)->place.x, 5.0);
  track.add(pose_at(5.1), 3010 * ms);
  EXPECT_NEAR(track.at(3500 * ms)->place.x, 5.2, 1e-9);
}

TEST(Track, CountsLossReorderingAndRepetition) {
  Track track({});
  const int sequences[] = {65533, 65534, 1, 0, 1, 2};  // 65535 is lost, 0 is late, 1 comes twice
  for (int i = 0; i < 6; ++i) {
    TrackedPose pose = pose_at(sequences[i]);
    pose.sequence = static_cast<std::uint16_t>(sequences[i]);
    EXPECT_EQ(track.add(pose, 20 * ms * i), i != 3 && i != 4);
  }
  EXPECT_EQ(track.counters().poses, 4u);
  EXPECT_EQ(track.counters().lost, 1u);
  EXPECT_EQ(track.counters().reordered, 1u);
  EXPECT_EQ(track.counters().repeated, 1u);
  // A sender that begins anew far away.
  TrackedPose pose = pose_at(7);
  pose.sequence = 30000;
  EXPECT_TRUE(track.add(pose, 200 * ms));
  EXPECT_EQ(track.counters().lost, 1u);
}

TEST(Track, TheSecondOfTwoWaysIsRepetition) {
  Track track({});
  // 2 is lost on both; each other number comes again behind the next.
  for (const int number : {1, 3, 1, 4, 3, 5, 4}) {
    TrackedPose pose = pose_at(number);
    pose.sequence = static_cast<std::uint16_t>(number);
    track.add(pose, 20 * ms * number);
  }
  EXPECT_EQ(track.counters().poses, 4u);
  EXPECT_EQ(track.counters().lost, 1u);
  EXPECT_EQ(track.counters().reordered, 0u);
  EXPECT_EQ(track.counters().repeated, 3u);
}

// The same of a camera that rests and tells no times.
TEST(Track, ASenderThatBeginsAnewAtRestIsFollowed) {
  Track track({});
  std::int64_t time = 0;
  for (const int last : {100, 60, 110})
    for (int i = 0; i < last; ++i) {
      TrackedPose pose = pose_at(1);
      pose.sequence = static_cast<std::uint16_t>(i);
      track.add(pose, time += 40 * ms);
    }
  EXPECT_EQ(track.counters().poses, 100u + 50u + 100u);
  EXPECT_EQ(track.counters().repeated, 10u);  // those that are looked for
}

// Of two ways the quicker ends, and the other is fifteen poses behind.
TEST(Track, TheSecondOfTwoWaysTakesOver) {
  Track track({});
  std::int64_t time = 0;
  const auto send = [&](int number) {
    TrackedPose pose = pose_at(number);
    pose.sequence = static_cast<std::uint16_t>(number);
    pose.capture_time_ns = 10 * ms * number;
    return track.add(pose, time += 10 * ms);
  };
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(send(i));
    if (i >= 15) {
      EXPECT_FALSE(send(i - 15));
    }
  }
  for (int i = 35; i < 50; ++i) EXPECT_FALSE(send(i));
  EXPECT_TRUE(send(50));
  EXPECT_EQ(track.counters().repeated, 50u);
  EXPECT_EQ(track.counters().reordered, 0u);
}

// A sender that is started again counts from 0, slightly below where it was.
TEST(Track, ASenderThatBeginsAnewIsFollowed) {
  for (const bool silent : {true, false}) {
    Track track({});
    std::int64_t time = 0;
    const auto send = [&](int number, double x) {
      TrackedPose pose = pose_at(x);
      pose.sequence = static_cast<std::uint16_t>(number);
      return track.add(pose, time += 40 * ms);
    };
    for (int i = 0; i < 100; ++i) EXPECT_TRUE(send(i, 0));
    if (silent) time += 1200 * ms;
    int taken = 0;
    for (int i = 0; i < 100; ++i) taken += send(i, 1);
    EXPECT_EQ(taken, silent ? 100 : 90);
    EXPECT_EQ(track.at(time)->place.x, 1.0);
    // What a silence has swallowed is lost.
    time += 1200 * ms;
    EXPECT_TRUE(send(120, 2));
    EXPECT_EQ(track.counters().lost, 20u);
  }
}

// A camera that pans by 30° a second, whose packets wait for 0 to 15 ms at a switch (none overtakes) and
// need 2 ms otherwise; its clock has begun elsewhere and is slow by .4 thousandths.
double worst_error(TrackTimes times, std::int64_t usual_delay) {
  TrackSettings settings;
  settings.times = times;
  settings.delay_ns = usual_delay;
  Track track(settings);
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int64_t> wait(0, 15 * ms);
  std::int64_t before = 0;
  double worst = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const std::int64_t taken = 10 * ms * i + 1000 * ms;
    TrackedPose pose = pose_at(0, 30e-9 * static_cast<double>(taken));
    pose.sequence = static_cast<std::uint16_t>(i);
    pose.capture_time_ns = 1'700'000'000'000'000'000 + taken - taken / 2500;
    before = std::max(before, taken + 2 * ms + wait(random));
    EXPECT_TRUE(track.add(pose, before));
    const std::int64_t asked = taken - 37 * ms;  // a frame that is mixed a little later
    if (i < 200) continue;                       // until one packet has not waited
    const Vec3 truth = axes_of_angles(30e-9 * static_cast<double>(asked), 0, 0)[1];
    const double angle = std::acos(std::min(1.0, glm::dot(track.at(asked)->axes[1], truth)));
    worst = std::max(worst, angle * 180.0 / std::numbers::pi);
  }
  EXPECT_EQ(track.counters().times_unusable, 0u);
  if (times == TrackTimes::sender) {
    // What is waited for is known, as it has to be told.
    EXPECT_NEAR(1e-6 * static_cast<double>(track.held_up_ns()), 15.0, 1.0);
  } else {
    EXPECT_EQ(track.held_up_ns(), 0);
  }
  return worst;
}

TEST(Track, TheSendersTimesTakeOutWhatPacketsWaited) {
  const double by_arrival = worst_error(TrackTimes::arrival, 10 * ms);  // in the mean
  const double by_sender = worst_error(TrackTimes::sender, 2 * ms);
  std::printf("panning by 30 degrees a second: off by up to %.3f by arrival, %.4f by the sender\n",
              by_arrival, by_sender);
  EXPECT_GT(by_arrival, 0.15);
  EXPECT_LT(by_sender, 0.02);
}

TEST(Track, OnTheSendersClockItsTimeIsTaken) {
  TrackSettings settings;
  settings.times = TrackTimes::clock;
  settings.clock_begin_ns = 1'700'000'000'000 * ms;
  Track track(settings);
  const auto add = [&](std::int64_t capture, std::int64_t arrival) {
    TrackedPose pose = pose_at(static_cast<double>(arrival));
    pose.capture_time_ns = *settings.clock_begin_ns + capture;
    EXPECT_TRUE(track.add(pose, arrival));
    return *track.end();
  };
  EXPECT_EQ(add(100 * ms, 107 * ms), 100 * ms);
  EXPECT_EQ(add(120 * ms, 121 * ms), 120 * ms);
  EXPECT_EQ(track.counters().times_unusable, 0u);
  // Another clock's, after all: by 37 s, as TAI and UTC are.
  EXPECT_EQ(add(37'140 * ms, 141 * ms), 141 * ms);
  EXPECT_EQ(track.counters().times_unusable, 1u);
  EXPECT_EQ(add(160 * ms, 163 * ms), 160 * ms);
  // Nobody knows what the clock showed: the quickest pose tells.
  settings.clock_begin_ns.reset();
  track.set(settings);
  settings.clock_begin_ns = 5;
  EXPECT_EQ(add(180 * ms, 183 * ms), 183 * ms);
  EXPECT_EQ(add(200 * ms, 211 * ms), 203 * ms + 10'000);  // and a drift of 5e-4
}

// A sample that is overtaken and tells no number, on a clock that both have.
TEST(Track, TimesThatGoBackOnTheSendersClockAreNotTaken) {
  TrackSettings settings;
  settings.times = TrackTimes::clock;
  settings.clock_begin_ns = 0;
  Track track(settings);
  for (int i = 0; i < 50; ++i) {
    TrackedPose pose = pose_at(i);
    pose.capture_time_ns = 20 * ms * (i == 40 ? 25 : i);
    EXPECT_TRUE(track.add(pose, 20 * ms * i + 5 * ms));
  }
  EXPECT_EQ(track.counters().times_unusable, 1u);
  EXPECT_EQ(track.at(20 * ms * 30)->place.x, 30.0);
  EXPECT_EQ(track.at(20 * ms * 45)->place.x, 45.0);
  // Both clocks are set back.
  for (int i = 0; i < 10; ++i) {
    TrackedPose pose = pose_at(i);
    pose.capture_time_ns = 20 * ms * i - 5000 * ms;
    EXPECT_TRUE(track.add(pose, 20 * ms * i - 4995 * ms));
  }
  EXPECT_EQ(track.counters().times_unusable, 1u);
}

TEST(Track, SendersTimesThatTellNothingGiveWayToArrivals) {
  TrackSettings settings;
  settings.times = TrackTimes::sender;
  Track track(settings);
  std::uint16_t sequence = 0;
  const auto add = [&](std::optional<std::int64_t> capture, std::int64_t arrival) {
    TrackedPose pose = pose_at(static_cast<double>(arrival));
    pose.capture_time_ns = capture;
    pose.sequence = ++sequence;
    EXPECT_TRUE(track.add(pose, arrival));
    return *track.end();
  };
  EXPECT_EQ(add({}, 10 * ms), 10 * ms);
  // It stands, and goes on seconds later.
  EXPECT_EQ(add(500 * ms, 20 * ms), 20 * ms);
  EXPECT_EQ(add(500 * ms, 31 * ms), 31 * ms);
  EXPECT_EQ(add(500 * ms, 3040 * ms), 3040 * ms);
  EXPECT_EQ(track.counters().times_unusable, 2u);
  EXPECT_EQ(add(510 * ms, 3050 * ms), 3050 * ms);
  // It begins anew, and jumps.
  EXPECT_EQ(add(5 * ms, 3060 * ms), 3060 * ms);
  EXPECT_EQ(add(15 * ms, 3072 * ms), 3070 * ms + 5'000);
  EXPECT_EQ(add(90'000 * ms, 3080 * ms), 3080 * ms);
  // After more than a second on the way.
  EXPECT_EQ(add(90'010 * ms, 5000 * ms), 5000 * ms);
  EXPECT_EQ(track.counters().times_unusable, 5u);
  // A late packet is left out, and is no clock that went back.
  TrackedPose late = pose_at(7);
  late.sequence = static_cast<std::uint16_t>(sequence - 1);
  late.capture_time_ns = 89'990 * ms;
  EXPECT_FALSE(track.add(late, 5001 * ms));
  EXPECT_EQ(track.counters().reordered, 1u);
  EXPECT_EQ(track.counters().times_unusable, 5u);
}

// Its sender may leave the number as it is, or the number may be all that moves.
TEST(Track, ACameraAtRestIsThere) {
  Track track({});
  TrackedPose pose = pose_at(1);
  pose.sequence = 0;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(track.add(pose, 20 * ms * i));
  EXPECT_EQ(track.counters().repeated, 0u);
  // One that counts, and sends a sample twice.
  for (std::uint16_t i = 1; i < 10; ++i) {
    pose.sequence = i;
    pose.capture_time_ns = 20 * ms * i;
    EXPECT_TRUE(track.add(pose, 2000 * ms + 20 * ms * i));
    EXPECT_FALSE(track.add(pose, 2001 * ms + 20 * ms * i));
  }
  EXPECT_EQ(track.counters().repeated, 9u);
  // The number stands for a while, time does not.
  pose.capture_time_ns = 300 * ms;
  EXPECT_TRUE(track.add(pose, 2300 * ms));
}

TEST(Track, FollowsOneSender) {
  Track track({});
  TrackedPose other = pose_at(100);
  other.source = "b";
  EXPECT_TRUE(track.add(pose_at(1), 0));
  EXPECT_FALSE(track.add(other, 10 * ms));
  EXPECT_EQ(track.counters().other_senders, 1u);
  EXPECT_EQ(track.at(10 * ms)->place.x, 1.0);
  // The first has been silent; nothing lies between the two.
  EXPECT_TRUE(track.add(other, 1200 * ms));
  EXPECT_EQ(track.at(1200 * ms)->place.x, 100.0);
  EXPECT_FALSE(track.at(600 * ms));
  TrackSettings settings;
  settings.source = "b";
  Track named(settings);
  EXPECT_FALSE(named.add(pose_at(1), 0));
  EXPECT_TRUE(named.add(other, 10 * ms));
}

TEST(Track, TheLensIsBetweenTheTwoAndNeverBeyond) {
  TrackSettings settings;
  settings.prediction_ns = 1000 * ms;
  Track track(settings);
  TrackedPose a = pose_at(0), b = pose_at(1);
  a.focal_length_mm = 20.0, b.focal_length_mm = 40.0;
  a.focus_distance_m = 2.0, b.focus_distance_m = 3.0;
  a.distortion = {0.1, 0, 0, 0, 0}, b.distortion = {0.3, 0, 0, 0, 0};
  b.projection_offset_mm = {0.4, 0};
  b.f_number = 4.0;
  track.add(a, 0);
  track.add(b, 100 * ms);
  TrackedPose pose = *track.at(25 * ms);
  EXPECT_DOUBLE_EQ(*pose.focal_length_mm, 25.0);
  EXPECT_DOUBLE_EQ(*pose.focus_distance_m, 2.25);
  EXPECT_DOUBLE_EQ(pose.distortion[0], 0.15);
  EXPECT_DOUBLE_EQ(pose.projection_offset_mm.x, 0.1);
  EXPECT_FALSE(pose.f_number);
  pose = *track.at(150 * ms);
  EXPECT_DOUBLE_EQ(pose.place.x, 1.5);
  EXPECT_DOUBLE_EQ(*pose.focal_length_mm, 40.0);
  EXPECT_DOUBLE_EQ(pose.distortion[0], 0.3);
  EXPECT_EQ(pose.f_number, 4.0);
}

TEST(Track, TheApertureIsTheFocalLengthOverTheFNumber) {
  TrackedPose pose = pose_at(0);
  pose.focal_length_mm.reset();
  EXPECT_EQ(aperture_of(pose), 0.0);
  pose.focal_length_mm = 50.0;
  EXPECT_EQ(aperture_of(pose), 0.0);
  for (const double none : {0.0, -2.0, std::nan("")}) {
    pose.f_number = none;
    EXPECT_EQ(aperture_of(pose), 0.0);
  }
  pose.f_number = 2.0;
  EXPECT_DOUBLE_EQ(aperture_of(pose), 0.025);
}

TEST(Track, StandsThroughASilence) {
  Track track({});
  track.add(pose_at(1), 0);
  track.add(pose_at(2), 10'000 * ms);
  EXPECT_EQ(track.at(9'999 * ms)->place.x, 1.0);
  EXPECT_EQ(track.at(10'000 * ms)->place.x, 2.0);
  EXPECT_EQ(track.begin(), 0);
  EXPECT_EQ(track.end(), 10'000 * ms);
  track.forget();
  EXPECT_FALSE(track.begin());
  EXPECT_EQ(track.counters().poses, 2u);
}

TEST(Track, KeepsABoundedMemory) {
  Track track({});
  for (int i = 0; i < 20000; ++i) track.add(pose_at(i), ms * i);
  EXPECT_FALSE(track.at(10000 * ms));
  EXPECT_NEAR(track.at(19000 * ms)->place.x, 19000.0, 1e-6);
}

}  // namespace
}  // namespace polyhull
