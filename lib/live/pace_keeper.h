// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which instants a live stage works on when not all can be done: its own Pace and what others
/// downstream of it have decided. The one that wants fewer frames is followed.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "live/frame_grid.h"
#include "live/pace.h"

namespace polyhull {

/// From running time `from` on (ns) the frames of `grid` are wanted, as long as they come not more
/// than `patience` (ns) after their time.
struct PaceChange {
  FrameGrid grid;
  std::int64_t from = 0;
  std::int64_t patience = INT64_MAX;
};

/// What a stage that works on single frames knows of the pace: it leaves out what is of no use.
/// Any thread. A time of INT64_MIN is none.
class PaceFilter {
 public:
  void hear(const PaceChange& change);
  /// Whether the frame at running time \p time is of use at running time \p now, both ns.
  bool wanted(std::int64_t time, std::int64_t now) const;
  void reset();

 private:
  mutable std::mutex mutex_;  // protects all below
  FrameGrids grids_;
  std::int64_t patience_ = INT64_MAX;
};

/// The pace of one stage, and what its sources are to know of it. Any thread, except for note().
class PaceKeeper {
 public:
  /// At the start of a stream, or of running time: every frame is wanted.
  void start();

  /// How late frames may come to be of use, ns.
  void set_patience(std::int64_t patience);

  /// Hears what a stage downstream has decided.
  void hear(const PaceChange& change);
  /// Hears from a sink that what belongs to before running time \p earliest (ns) comes too late for
  /// it.
  void hear_earliest(std::int64_t earliest) { earliest_ = earliest; }

  /// Whether the instant at running time \p time (ns) is wanted.
  bool wanted(std::int64_t time) const;
  bool too_late(std::int64_t time) const { return time < earliest_; }

  /// Notes at running time \p now that the wanted instant \p time was \p lost, or was not, in a
  /// stream with \p interval between its instants (all ns; interval 0: unknown, nothing is
  /// decided).
  void note(std::int64_t now, std::int64_t time, std::int64_t interval, bool lost);

  /// Whether the stage itself asks for fewer frames than there are.
  bool thins() const { return pace_.step() > 1; }

  /// What sources are to know, and its version, above 0.
  PaceChange change(std::uint64_t& version) const;
  /// Every how many frames one is wanted.
  std::uint64_t step() const;

 private:
  /// Takes over the sparser of the two decisions from running time \p from on.
  void follow(std::int64_t from);

  Pace pace_;                      // these two: note()'s thread's
  std::int64_t kept_ = INT64_MIN;  // the last instant that was not lost
  std::atomic<std::int64_t> earliest_{INT64_MIN};
  mutable std::mutex mutex_;  // protects the rest
  FrameGrid own_, downstream_;
  FrameGrids grids_;
  PaceChange now_;             // what sources are to know
  std::uint64_t version_ = 1;  // of it
};

}  // namespace polyhull
