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
/// camera's clock the receiver's may run; a slower one is followed at once.
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

  /// How often the camera's clock has begun anew: it went back, or moved by a second more or less
  /// than the arrivals, other than by frames that were held up.
  std::uint64_t restarts() const { return restarts_; }

  /// Forgets the camera's clock; restarts() stays.
  void reset();

 private:
  bool begun_ = false;
  std::int64_t first_ = 0, last_ = 0, delay_ = 0;  // camera's times; arrival less time
  std::uint64_t restarts_ = 0;
};

}  // namespace polyhull
