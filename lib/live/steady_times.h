// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A camera's own times on the clock of who receives its frames.
///
/// A camera stamps its frames evenly, on a clock of its own; they arrive later, by what exposure,
/// readout and transfer take and by what holds them up. With t_i the camera's times and a_i the
/// arrivals, the least of a_i - t_i is the delay of frames that nothing held up, so frame i was taken
/// at
///     t_i + min over k <= i of (a_k - t_k + d (t_i - t_k))
/// less that delay's constant part, which times alone do not tell. d bounds how much faster than the
/// camera's clock the receiver's may run; a slower one is followed at once. Where for ten seconds
/// all frames, and twenty at least, came later than that by a step, one of the two clocks was set, or
/// the way has become that much longer: times alone do not tell which. The least delay of these
/// seconds holds from then on.
#pragma once

#include <cstdint>
#include <optional>

namespace polyhull {

/// All times ns. For one thread.
class SteadyTimes {
 public:
  struct Settings {
    std::int64_t settle = 500'000'000;  ///< how long frames are only looked at
    double drift = 1e-4;                ///< d: 0 to 0.01
    std::int64_t step = 1'000'000'000;  ///< by how much all frames come later where a clock was set
  };

  struct Placed {
    std::int64_t time = 0;     ///< on the receiver's clock, never after the arrival
    std::int64_t held_up = 0;  ///< by how much later than the quickest frame this one came
  };

  /// Places the frame that the camera took at \p time and that came at \p arrival; nothing while the
  /// delay is being learned.
  std::optional<Placed> place(std::int64_t time, std::int64_t arrival, const Settings& settings);

  /// The least delay, as it is now; 0 before the first frame.
  std::int64_t delay() const { return delay_; }

  /// How often the camera's clock has begun anew: it went back, or moved by a second more, or lastingly
  /// by a step less, than the arrivals.
  std::uint64_t restarts() const { return restarts_; }

  /// Forgets the camera's clock; restarts() stays.
  void reset();

 private:
  void look_for_step(std::int64_t arrival, std::int64_t delay, std::int64_t step);

  bool begun_ = false;
  std::int64_t first_ = 0, last_ = 0, delay_ = 0;  // camera's times; arrival less time
  // Since when, by arrivals, all frames are later by a step; how many, the last, their least delay.
  std::optional<std::int64_t> late_since_;
  int late_frames_ = 0;
  std::int64_t late_last_ = 0, late_delay_ = 0;
  std::uint64_t restarts_ = 0;
};

}  // namespace polyhull
