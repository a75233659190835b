// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A tracked camera over time: poses as they arrive, and the pose at the time of a frame.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "track/tracked_pose.h"

namespace polyhull {

struct TrackSettings {
  std::string source;         ///< the only TrackedPose::source to follow; empty: the first heard
  std::int64_t delay_ns = 0;  ///< how long a pose has been true when it arrives
  std::int64_t smoothing_ns = 0;  ///< 0 or above: poses are averaged over that long before the time
                                  ///< asked for, which makes them late by half of it
  std::int64_t prediction_ns =
      0;  ///< how far motion goes on after the last pose, as it was over the
          ///< same time before, or 50 ms; 0: it stands
};

struct TrackCounters {
  std::uint64_t poses = 0;          ///< taken
  std::uint64_t lost = 0;           ///< sequence numbers that never came
  std::uint64_t reordered = 0;      ///< came after later ones, and were left out
  std::uint64_t repeated = 0;       ///< came twice, and were taken once
  std::uint64_t other_senders = 0;  ///< of another source than the one followed
};

/// Not for several threads at once. Times are nanoseconds on the clock of the caller, who says when a
/// pose arrived; the sender's own times are not used.
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
  const TrackCounters& counters() const { return counters_; }

 private:
  struct Timed {
    std::int64_t time;
    TrackedPose pose;
  };
  bool follows(const TrackedPose& pose, std::int64_t arrival_ns);
  bool in_order(const TrackedPose& pose);
  TrackedPose predicted(std::int64_t time_ns) const;
  std::optional<TrackedPose> unsmoothed(std::int64_t time_ns) const;

  TrackSettings settings_;
  TrackCounters counters_;
  std::optional<std::string> sender_;
  std::int64_t heard_ns_ = 0;
  std::deque<Timed> poses_;  // times grow strictly
};

}  // namespace polyhull
