// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which of several cameras' clocks drift, and by how much they have gained.
///
/// A frame's lead is the time its camera's clock gives it less the time it came by this machine's
/// clock: minus its delay, plus what the one clock has gained on the other. Delays have a least
/// value, so the largest lead of many frames tells the gain. In blocks of two seconds let l_c(k) be
/// the largest lead of camera c. What all clocks gain alike is this machine's clock's fault (or the
/// network's); it is taken out by the median over the cameras,
///
///     g_c(k) = l_c(k) - l_c(first) - median_c (l_c(k) - l_c(first)),
///
/// of an even number of cameras with a clock that gains nothing among them, so that of two the one
/// nearer to this machine's is right. A line through g_c over the last five minutes is the drift: it
/// is believed from half a minute and 3 ms on, where the points lie within a tenth of its rise. A
/// delay that grows all at once makes a step, which does not.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>

namespace polyhull {

/// For one thread at a time.
class ClockDrifts {
 public:
  /// A camera; compared only.
  using Key = const void*;

  /// A frame of \p camera came at \p arrival with the time \p time of its clock, both ns; \p arrival
  /// is of a clock that nobody sets and does not fall. Returns the drift in millionths (fast:
  /// positive) where the clock has just been found to drift, else 0.
  double note(Key camera, std::int64_t time, std::int64_t arrival);

  /// By how much the clock of \p camera has gained at \p arrival since its first frames, ns; 0: it
  /// does not drift.
  std::int64_t gained(Key camera, std::int64_t arrival) const;

  /// \p camera starts anew.
  void forget(Key camera) { cameras_.erase(camera); }
  /// Forgets the cameras that \p keep is false for.
  template <class Keep>
  void keep_only(const Keep& keep) {
    std::erase_if(cameras_, [&](const auto& entry) { return !keep(entry.first); });
  }

 private:
  struct Point {
    std::int64_t time;  // arrival of the frame that tells it, ns
    double gain;        // ns
  };
  struct Camera {
    std::optional<std::int64_t> lead;   // the largest of the present block, ns
    std::optional<std::int64_t> first;  // ... of its first, less what the others had gained, ns
    std::int64_t time = 0;              // arrival of the frame with the largest lead, ns
    std::deque<Point> points;
    bool drifts = false;
    double rate = 0;    // of the last line, 0: where there is none
    double gained = 0;  // at `since`, ns
    std::int64_t since = 0;
  };
  void close_block();
  void judge(Camera& camera);

  std::map<Key, Camera> cameras_;
  std::int64_t block_ = 0;  // the present one
};

}  // namespace polyhull
