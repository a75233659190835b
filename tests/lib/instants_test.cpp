// SPDX-License-Identifier: LGPL-2.1-or-later
// One time for all cameras, from running times, capture times on several clocks, and timecodes.
#include "mesh/instants.h"

#include <gtest/gtest.h>

namespace polyhull {
namespace {

constexpr std::int64_t ms = 1'000'000, second = 1000 * ms, hour = 3600 * second;
constexpr std::int64_t frame = 40 * ms;
constexpr std::int64_t epoch = 1'700'000'000 * second;
constexpr std::int64_t boot = 5000 * second;  // the pipeline's clock at running time 0
const int cameras[4] = {};

Instants::Key camera(int i) {
  return &cameras[i];
}

/// Now, where this pipeline has run for \p running.
ArrivalTimes at(std::int64_t running, std::int64_t base = boot) {
  return {777 * second + running, base, running, epoch + running};
}
ArrivalTimes live_at(std::int64_t running) {
  ArrivalTimes now = at(running);
  now.live = true;
  return now;
}
ViewTimes arrived(std::int64_t running, std::int64_t base = boot) {
  return {running, base + running, CaptureClock::arrival, no_time};
}
ViewTimes taken(std::int64_t running, std::int64_t time, CaptureClock clock) {
  return {running, time, clock, no_time};
}

TEST(Instants, ViewsOfThisPipelineStayWhereTheyAre) {
  Instants instants;
  for (int i = 0; i < 50; ++i)
    for (int c = 0; c < 2; ++c) {
      // Some stamped before, some after a pause, and some before the clock was known.
      const std::int64_t base = i < 10 ? 0 : i < 30 ? boot : boot + 20 * second;
      const std::int64_t stamped = i < 10 || c == 0 ? base : i < 32 ? boot : base;
      EXPECT_EQ(instants.place(camera(c), arrived(i * frame, stamped), at(i * frame, base)).time,
                i * frame);
    }
  EXPECT_EQ(instants.axis(), TimeAxis::pipeline);
}

TEST(Instants, BranchesStartedSecondsApartMeet) {
  for (const std::int64_t later : {1 * second, 3 * second, -3 * second}) {
    Instants instants;
    for (int i = 100; i < 150; ++i) {
      const ArrivalTimes now = at(i * frame + 5 * ms);
      // This pipeline's, and one that was started later.
      EXPECT_EQ(instants.place(camera(0), arrived(i * frame), now).time, i * frame);
      EXPECT_EQ(instants.place(camera(1), arrived(i * frame - later, boot + later), now).time,
                i * frame);
    }
  }
}

TEST(Instants, NoneOfThisPipelineItsClockCounts) {
  Instants instants;
  for (int i = 100; i < 120; ++i)
    for (int c = 0; c < 2; ++c) {
      const std::int64_t base = boot - (c + 1) * 2 * second;  // both were there before
      const auto placed = instants.place(camera(c), arrived(boot + i * frame - base, base),
                                         live_at(i * frame + 7 * ms));
      EXPECT_EQ(placed.time, i * frame);
    }
}

TEST(Instants, TimesSince1970AreThisMachines) {
  Instants instants;
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      // They come 30 and 55 ms after they were taken.
      const std::int64_t late = c == 0 ? 30 * ms : 55 * ms;
      const ViewTimes view = taken(i * frame + late, epoch + i * frame, CaptureClock::unix);
      EXPECT_EQ(instants.place(camera(c), view, live_at(i * frame + late)).time, i * frame);
    }
  EXPECT_EQ(instants.axis(), TimeAxis::unix);
}

// As of a take that is played seconds after it was recorded.
TEST(Instants, RecordedTimesAreNotOfThisPipelinesClock) {
  for (const CaptureClock clock : {CaptureClock::arrival, CaptureClock::unix}) {
    Instants instants;
    for (int i = 0; i < 20; ++i)
      for (int c = 0; c < 2; ++c) {
        const std::int64_t recorded = (clock == CaptureClock::unix ? epoch - second
                                       : i < 3 + c                 ? 0  // before the clock ran
                                                                   : boot - 5 * second) +
                                      i * frame;
        EXPECT_EQ(instants.place(camera(c), taken(i * frame, recorded, clock), at(i * ms)).time,
                  i * frame);
      }
  }
}

TEST(Instants, OtherClocksBeginWhereTheFirstViewIs) {
  Instants instants;
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      const std::int64_t running = i * frame + c * 25 * ms;
      const ViewTimes view = taken(running, 37 * hour + i * frame, CaptureClock::ptp);
      EXPECT_EQ(instants.place(camera(c), view, at(running)).time, i * frame);
    }
}

TEST(Instants, ClocksThatNobodyHasSetMakeRunningTimesDecide) {
  Instants instants;
  const auto view = [](int i, int c) {
    return taken(i * frame, (c == 0 ? 7 : 9000) * second + i * frame, CaptureClock::ptp);
  };
  EXPECT_EQ(instants.place(camera(0), view(0, 0), at(0)).apart.from, nullptr);
  EXPECT_EQ(instants.place(camera(1), view(0, 1), at(0)).apart.from, camera(0));
  for (int i = 1; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      const auto placed = instants.place(camera(c), view(i, c), at(i * frame));
      EXPECT_EQ(placed.time, i * frame);
      EXPECT_EQ(placed.apart.from, nullptr);  // said once
    }
  EXPECT_EQ(instants.axis(), TimeAxis::running);
}

TEST(Instants, ACameraOfThisPipelineBesideAMachineOfAnotherTimeStaysWhereItIs) {
  Instants instants;
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      // The other machine's views come first; it was started an hour before.
      const ViewTimes view = arrived(i * frame, c == 0 ? boot + hour : boot);
      const auto placed = instants.place(camera(c), view, at(i * frame));
      EXPECT_EQ(placed.apart.from, i == 0 && c == 1 ? camera(0) : nullptr);
      if (i > 0) {
        EXPECT_EQ(placed.time, i * frame) << c;
      }
    }
  EXPECT_EQ(instants.axis(), TimeAxis::running);
}

TEST(Instants, AfterAFlushOfAllCamerasTimeBeginsAnew) {
  Instants instants;
  for (int c = 0; c < 2; ++c)
    instants.place(camera(c), taken(600 * second, epoch, CaptureClock::ptp), at(600 * second));
  for (int c = 0; c < 2; ++c) instants.forget(camera(c));
  for (int c = 0; c < 2; ++c) {
    const ViewTimes view = taken(0, epoch + second, CaptureClock::ptp);
    EXPECT_EQ(instants.place(camera(c), view, at(0)).time, 0);
  }
}

TEST(Instants, SoDoClocksThatAreNotTheSameAndCamerasWithoutOne) {
  Instants instants;
  instants.place(camera(0), taken(0, epoch, CaptureClock::unix), at(0));
  EXPECT_EQ(instants.axis(), TimeAxis::unix);
  instants.place(camera(1), taken(0, epoch, CaptureClock::ptp), at(0));
  EXPECT_EQ(instants.axis(), TimeAxis::running);
  instants.forget(camera(1));
  instants.place(camera(2), {frame, no_time, {}, no_time}, at(frame));
  EXPECT_EQ(instants.axis(), TimeAxis::running);
  instants.keep_only(std::vector{camera(0)});
  instants.place(camera(0), taken(frame, epoch + frame, CaptureClock::unix), at(frame));
  EXPECT_EQ(instants.axis(), TimeAxis::unix);
}

TEST(Instants, AClockThatJumpsIsToldAndFollowed) {
  Instants instants;
  for (int i = 0; i < 100; ++i)
    for (int c = 0; c < 2; ++c) {
      const std::int64_t wrong = c == 1 && i >= 30 && i < 60 ? hour : 0;
      const std::int64_t jitter = i % 3 * ms;
      const ViewTimes view =
          taken(i * frame + jitter, 37 * hour + i * frame + wrong, CaptureClock::ptp);
      const auto placed = instants.place(camera(c), view, at(i * frame + jitter));
      const bool jumps = c == 1 && (i == 30 || i == 60);
      EXPECT_EQ(placed.jump != 0, jumps) << i;
      if (jumps) {
        EXPECT_NEAR(static_cast<double>(placed.jump), (i == 30 ? 1.0 : -1.0) * hour, 2.0 * ms);
      }
      // As exact as running times meanwhile, and as before once it is right again.
      EXPECT_NEAR(static_cast<double>(placed.time), i * frame, wrong != 0 ? 2.0 * ms : 0.0) << i;
    }
}

TEST(Instants, NeitherAStallNorARestartIsAJump) {
  Instants instants;
  std::int64_t running = 0;
  for (int i = 0; i < 100; ++i) {
    const std::int64_t capture = i * frame + (i >= 60 ? 20 * second : 0);
    // From 30 on all comes five seconds late; at 60 the sender was started again.
    running = i < 60 ? i * frame : (i - 60) * frame;
    const ArrivalTimes now = at(capture + (i >= 30 ? 5 * second : 0));
    const auto placed =
        instants.place(camera(0), taken(running, capture + hour, CaptureClock::ptp), now);
    EXPECT_EQ(placed.jump, 0) << i;
    EXPECT_EQ(placed.time, capture);
  }
}

TEST(Instants, TimecodesComeFirst) {
  Instants instants;
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      ViewTimes view =
          taken(i * frame + c * 3 * second, epoch + c * 12 * ms + i * frame, CaptureClock::unix);
      view.timecode = 10 * hour + i * frame;
      EXPECT_EQ(instants.place(camera(c), view, at(i * frame)).time, i * frame);
    }
  EXPECT_EQ(instants.axis(), TimeAxis::timecode);
}

TEST(Instants, TimecodesPassMidnight) {
  Instants instants;
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) {
      ViewTimes view{i * frame + c * second, no_time, {}, no_time};
      view.timecode = (24 * hour - 10 * frame + i * frame) % (24 * hour);
      const auto placed = instants.place(camera(c), view, at(i * frame));
      EXPECT_EQ(placed.time, i * frame);
      EXPECT_EQ(placed.jump, 0);
    }
}

TEST(Instants, APauseStopsACamerasClockNot) {
  for (const bool live : {true, false}) {
    Instants instants;
    constexpr std::int64_t pause = 8 * second;
    for (int i = 0; i < 60; ++i)
      for (int c = 0; c < 2; ++c) {
        const std::int64_t paused = i >= 30 ? pause : 0;
        ArrivalTimes now = at(i * frame, boot + paused);
        now.monotonic += paused;
        const ViewTimes view =
            taken(i * frame, hour + i * frame + (live ? paused : 0), CaptureClock::ptp);
        const auto placed = instants.place(camera(c), view, now);
        EXPECT_EQ(placed.time, i * frame) << i;
        EXPECT_EQ(placed.jump, 0);
      }
  }
}

// Camera 1 has five views of before the pause in a queue when it ends.
TEST(Instants, ViewsThatWaitedThroughAPauseDoNotHideIt) {
  Instants instants;
  constexpr std::int64_t pause = 8 * second;
  for (int i = 0; i < 60; ++i)
    for (int c = 0; c < 2; ++c) {
      if (c == 1 && i >= 30 && i < 35) continue;  // they come below
      ArrivalTimes now = at(i * frame, boot + (i >= 25 ? pause : 0));
      now.monotonic += i >= 25 ? pause : 0;
      const std::int64_t paused = i >= 30 ? pause : 0;  // 25 to 29 were taken before
      const auto placed = instants.place(
          camera(c), taken(i * frame, hour + i * frame + paused, CaptureClock::ptp), now);
      EXPECT_EQ(placed.time, i * frame) << c << " " << i;
      EXPECT_EQ(placed.jump, 0);
    }
}

// A view of before waited through the first pause; the next one was taken after the second.
TEST(Instants, TwoPausesInARowAddUp) {
  Instants instants;
  for (int i = 0; i < 60; ++i)
    for (int c = 0; c < 2; ++c) {
      const std::int64_t stood = i < 30 ? 0 : i == 30 ? 8 * second : 13 * second;
      ArrivalTimes now = at(i * frame, boot + stood);
      now.monotonic += stood;
      const std::int64_t paused = i > 30 ? stood : 0;
      const auto placed = instants.place(
          camera(c), taken(i * frame, hour + i * frame + paused, CaptureClock::ptp), now);
      EXPECT_EQ(placed.time, i * frame) << c << " " << i;
      EXPECT_EQ(placed.jump, 0);
    }
}

TEST(Instants, OneCamerasOldViewsMeetThePauseThatAnotherHasShown) {
  Instants instants;
  constexpr std::int64_t pause = 8 * second;
  const auto place = [&](int c, int i, bool after, bool old) {
    ArrivalTimes now = at(i * frame, boot + (after ? pause : 0));
    now.monotonic += after ? pause : 0;
    const std::int64_t paused = after && !old ? pause : 0;
    return instants
        .place(camera(c), taken(i * frame, hour + i * frame + paused, CaptureClock::ptp), now)
        .time;
  };
  for (int i = 0; i < 20; ++i)
    for (int c = 0; c < 2; ++c) EXPECT_EQ(place(c, i, false, false), i * frame);
  for (int i = 20; i < 23; ++i) EXPECT_EQ(place(0, i, true, false), i * frame);
  for (int i = 20; i < 23; ++i) EXPECT_EQ(place(1, i, true, true), i * frame);
  for (int i = 23; i < 40; ++i)
    for (int c = 0; c < 2; ++c) EXPECT_EQ(place(c, i, true, false), i * frame);
}

TEST(Instants, ClocksSecondsApartAreNoSharedOnesInALiveStream) {
  for (const std::int64_t off : {2 * second, 12 * second, -5 * second}) {
    Instants instants;
    int told = 0;
    for (int i = 0; i < 100; ++i)
      for (int c = 0; c < 2; ++c) {
        ArrivalTimes now = at(i * frame + 30 * ms);
        now.live = true;
        const ViewTimes view =
            taken(i * frame, hour + i * frame + (c == 1 ? off : 0), CaptureClock::ptp);
        const auto placed = instants.place(camera(c), view, now);
        if (placed.apart.from != nullptr) {
          ++told;
          EXPECT_EQ(placed.apart.from, camera(1 - c));
          EXPECT_EQ(placed.apart.difference, c == 1 ? off : -off);
        }
        if (i > 30) {
          EXPECT_EQ(placed.time, i * frame);
        }
      }
    EXPECT_EQ(told, 1);
    EXPECT_EQ(instants.axis(), TimeAxis::running);
  }
}

TEST(Instants, WhatHasPiledUpBeforeAStartIsNoOtherClock) {
  Instants instants;
  for (int i = 0; i < 100; ++i)
    for (int c = 0; c < 2; ++c) {
      // The second camera's first views have waited for up to four seconds.
      const std::int64_t waited =
          c == 1 ? std::max<std::int64_t>(0, 4 * second - i * 8 * frame) : 0;
      ArrivalTimes now = at(i * frame);
      now.live = true;
      const std::int64_t time = hour + i * frame - waited;
      const auto placed = instants.place(camera(c), taken(i * frame, time, CaptureClock::ptp), now);
      EXPECT_EQ(placed.apart.from, nullptr);
      EXPECT_EQ(placed.time, i * frame - waited);
    }
}

// The running times are those of the receipt, as of a network source that stamps.
TEST(Instants, AStallOfViewsStampedAtTheirReceiptIsNoJump) {
  for (const int lost : {0, 100}) {  // at the stall's end, after a first view of before it
    Instants instants;
    for (int i = 0; i < 300; ++i) {
      if (i > 100 && i <= 100 + lost) continue;
      const std::int64_t capture = i * frame;
      const std::int64_t came =
          i >= 100 ? std::max(capture, 100 * frame + 5 * second + (i - 100) * ms) : capture;
      const auto placed =
          instants.place(camera(0), taken(came, capture + hour, CaptureClock::ptp), at(came));
      EXPECT_EQ(placed.jump, 0) << i;
      EXPECT_EQ(placed.time, capture) << i;
    }
    // A jump is one as before.
    const auto placed =
        instants.place(camera(0), taken(300 * frame, 2 * hour, CaptureClock::ptp), at(300 * frame));
    EXPECT_NE(placed.jump, 0);
    EXPECT_EQ(placed.time, 300 * frame);
  }
}

// As gst_video_time_code_nsec_since_daily_jam() has them.
TEST(Instants, FractionalTimecodesPassMidnight) {
  struct Rate {
    std::int64_t numerator, frames_a_day;
  };
  for (const auto& [numerator, frames_a_day] :
       {Rate{30000, 24 * 3600 * 30}, Rate{30000, 2589408}, Rate{60000, 2 * 2589408},
        Rate{24000, 24 * 3600 * 24}, Rate{60000, 24 * 3600 * 60}}) {
    Instants instants;
    for (int i = 0; i < 40; ++i)
      for (int c = 0; c < 3; ++c) {
        if (c == 2 && i < 30) continue;  // joins after midnight
        const std::int64_t running = i * 1001 * second / numerator;
        ViewTimes view{running + c * second, no_time, {}, no_time};
        view.timecode = (frames_a_day - 20 + i) % frames_a_day * 1001 * second / numerator;
        const auto placed = instants.place(camera(c), view, at(running));
        EXPECT_NEAR(static_cast<double>(placed.time), static_cast<double>(running), 2.0) << c;
        EXPECT_EQ(placed.jump, 0);
      }
  }
}

TEST(Instants, TimeGoesOnWhereTheAxisChanges) {
  Instants instants;
  // The second camera joins at 20 with a clock; up to then the first's timecode counted, placed
  // three seconds off its running time.
  for (int i = 0; i < 40; ++i) {
    ViewTimes first = taken(i * frame, 50 * hour + i * frame, CaptureClock::ptp);
    first.timecode = hour + i * frame;
    EXPECT_EQ(instants.place(camera(0), first, at(i * frame)).time, i * frame);
    if (i < 20) continue;
    const ViewTimes second_camera =
        taken(i * frame - 3 * second, 50 * hour + i * frame, CaptureClock::ptp);
    EXPECT_EQ(instants.place(camera(1), second_camera, at(i * frame)).time, i * frame);
    EXPECT_EQ(instants.axis(), TimeAxis::ptp);
  }
}

TEST(Instants, ViewsWithoutBufferTimesHaveNone) {
  Instants instants;
  const auto placed = instants.place(camera(0), taken(no_time, epoch, CaptureClock::unix), at(0));
  EXPECT_EQ(placed.time, no_time);
}

}  // namespace
}  // namespace polyhull
