// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Holds a target rate by coarsening and refining the contours' tolerance, as Matusik et al.
/// propose (Polyhedral Visual Hulls for Real-Time Rendering, 2001, section 3).
///
/// The load is the time that the slowest stage behind the contours needs for one set, divided by
/// the time that the target rate leaves for it: above 1 the rate is missed. The tolerance is base *
/// 2^(level / 2) with a whole level from 0 to 8, so it moves in steps of 41 % between the base and
/// 16 times the base; the number of contour vertices, and with it the time of the hull, falls
/// roughly with its square root.
///
/// To hold without oscillating:
///  - decisions are made on the mean load of a window of half a second, and a new window begins
///    after each, so that a step's effect is seen before the next;
///  - one step up when the mean is above 1, at once two above 2;
///  - one step down only when the mean is below 0.7 for a whole waiting time, 2 s at first. A step
///    changes the load by less than 1/0.7, so the step down alone does not cause the next step up;
///  - a step down that is followed by a step up within two waiting times was wrong: the waiting
///    time doubles, up to 64 s. It halves again, down to 2 s, each time a step down has proved
///    itself.
#pragma once

#include <cstdint>

namespace polyhull {

class AdaptiveTolerance {
 public:
  static constexpr int highest_level = 8;

  /// Takes one observation. \p load: see above, anything that is not finite and positive is
  /// ignored. \p time: when it was observed, ns on any clock that does not run backwards (a jump
  /// backwards, as after a seek, begins a new window).
  void observe(double load, std::int64_t time);

  /// The tolerance to use now, for the user's \p base, both in px.
  double tolerance(double base) const;

  /// 0 to highest_level.
  int level() const { return level_; }

  /// Back to level 0 with everything forgotten.
  void reset() { *this = AdaptiveTolerance(); }

 private:
  void begin_window(std::int64_t time);
  void step_up(int steps, std::int64_t time);
  void step_down(std::int64_t time);

  int level_ = 0;
  double sum_ = 0.0;
  int count_ = 0;
  std::int64_t window_begin_ = INT64_MIN;
  std::int64_t calm_since_ = INT64_MIN;  // since when each window's mean was below the lower bound
  std::int64_t last_down_ = INT64_MIN;   // INT64_MIN: none that is still on trial
  std::int64_t wait_ = 2'000'000'000;
};

}  // namespace polyhull
