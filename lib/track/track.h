// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A tracked camera over time: poses as they arrive, and the pose at the time of a frame.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "live/lateness_window.h"
#include "live/steady_times.h"
#include "track/tracked_pose.h"

namespace polyhull {

/// What says when a pose was true.
enum class TrackTimes {
  arrival,  ///< when it came
  sender,   ///< the sender's time, brought onto the receiver's clock by the quickest poses
  clock,    ///< the sender's time, as the receiver's clock is the same
};

struct TrackSettings {
  std::string source;         ///< the only TrackedPose::source to follow; empty: the first heard
  std::int64_t delay_ns = 0;  ///< how long a pose has been true when it arrives
  TrackTimes times = TrackTimes::arrival;
  /// Of `clock`: the sender's time at the receiver's 0; where nobody knows, `clock` is `sender`.
  std::optional<std::int64_t> clock_begin_ns;
  std::int64_t smoothing_ns = 0;  ///< 0 or above: poses are averaged over that long before the time
                                  ///< asked for, which makes them late by half of it
  std::int64_t prediction_ns =
      0;  ///< how far motion goes on after the last pose, as it was over the
          ///< same time before, or 50 ms; 0: it stands
};

struct TrackCounters {
  std::uint64_t poses = 0;          ///< taken
  std::uint64_t lost = 0;           ///< sequence numbers that never came
  std::uint64_t reordered = 0;      ///< came after later ones for the first time, and were left out
  std::uint64_t repeated = 0;       ///< came twice, and were taken once
  std::uint64_t other_senders = 0;  ///< of another source than the one followed
  /// Sender's times that could not be used, so that the arrival was taken: they stood, or are more than
  /// a second from the arrival on the same clock, or went back there by less than a second. And how
  /// often a sender's clock was found to have been set (live/steady_times.h).
  std::uint64_t times_unusable = 0;
};

/// Not for several threads at once. Times are nanoseconds on the clock of the caller, who says when a
/// pose arrived. Which of two poses came first, and who is silent, is told by their arrival and their
/// sequence alone.
///
/// Packets wait at switches, and receivers wake up late: arrivals are as uneven as that. With
/// `TrackTimes::sender` a pose stands at its own time plus the least delay of those so far
/// (live/steady_times.h), as if none had waited.
class Track {
 public:
  static constexpr std::int64_t silence_ns =
      1'000'000'000;  ///< after which another sender may follow
  static constexpr std::int64_t memory_ns = 2'000'000'000;  ///< how far back poses are kept
  static constexpr std::size_t most_poses = 4096;           ///< kept at once

  /// Throws Error (bad_input) for a negative smoothing or prediction, and a smoothing beyond
  /// `memory_ns`.
  explicit Track(TrackSettings settings);

  /// Follows other settings from now on; what is kept stays. Throws as the constructor does.
  void set(TrackSettings settings);

  /// Forgets all poses, and whom it follows; counters stay.
  void forget();

  /// Takes \p pose, which arrived at \p arrival_ns; whether it was of use. Poses of one sender arrive
  /// in no order that matters: `sequence` tells.
  bool add(const TrackedPose& pose, std::int64_t arrival_ns);

  /// The pose at \p time_ns: between two poses on the straight line and the shortest turn (where
  /// they are more than `silence_ns` apart, the first one), after the last one as `prediction_ns` says. None at a time before the first pose that is kept.
  std::optional<TrackedPose> at(std::int64_t time_ns) const;

  /// The time of the first and of the last pose that is kept; none before the first.
  std::optional<std::int64_t> begin() const;
  std::optional<std::int64_t> end() const;

  /// How much later than the truth `at` is by its own doing: half of the smoothing.
  std::int64_t lag_ns() const { return settings_.smoothing_ns / 2; }
  /// By how much later than their times poses usually come, with the delay taken as 0.
  std::int64_t held_up_ns() const { return held_up_.usually_largest(heard_ns_).value_or(0); }
  const TrackCounters& counters() const { return counters_; }

 private:
  struct Timed {
    std::int64_t time;
    TrackedPose pose;
  };
  void forget_sender();
  bool follows(const TrackedPose& pose, std::int64_t arrival_ns);
  bool begins_anew(std::uint16_t sequence);
  const TrackedPose* kept(std::uint16_t sequence) const;
  bool left_out(const TrackedPose& pose);
  bool in_order(const TrackedPose& pose);
  std::int64_t true_time(const TrackedPose& pose, std::int64_t arrival_ns);
  std::int64_t unusable_time(std::int64_t arrival_ns);
  TrackedPose predicted(std::int64_t time_ns) const;
  std::optional<TrackedPose> unsmoothed(std::int64_t time_ns) const;

  TrackSettings settings_;
  TrackCounters counters_;
  std::optional<std::string> sender_;
  std::int64_t heard_ns_ = 0;
  bool numbers_move_ = false;  // the sender's
  bool was_silent_ = false;    // it, before the pose that comes
  // Poses that were left out one after the other, each of the next number, and the last one's.
  int left_out_in_a_row_ = 0;
  std::uint16_t left_out_ = 0;
  SteadyTimes steady_;
  std::optional<std::int64_t> capture_ns_;  // of the last pose with one
  std::optional<std::int64_t> used_ns_;     // of the last whose own time was taken by `clock`
  LatenessWindow held_up_;
  std::deque<Timed> poses_;  // times grow strictly
};

}  // namespace polyhull
