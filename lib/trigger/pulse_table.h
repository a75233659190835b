// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The pulses that were given lately, for all who look for the pulse that a frame answers to.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "trigger/pulse.h"

namespace polyhull {

/// The last pulses of one trigger: their numbers follow one another without a gap. Any thread.
class PulseTable {
 public:
  /// How many pulses are kept: more than a minute at 60 pulses per second.
  static constexpr std::size_t capacity = 4096;

  /// The next pulse, just before it is given, so that no frame can come before it. Its number is
  /// that of the one before plus 1, or any for the first of a round.
  void add(const Pulse& pulse);

  /// Takes the latest pulse back: the device did not give it.
  void withdraw();

  /// Forgets all; numbers start anew, in another round.
  void begin_round();

  /// What pulses there are between two times.
  struct Answer {
    std::uint64_t round = 0;  ///< of all that follows
    std::uint64_t begin = 0;  ///< number of the first pulse from the begin of the time on; `next`
                              ///< where there is none
    std::size_t count = 0;    ///< pulses from there on within the time
    std::int64_t time = 0;    ///< of the first of them
    std::uint64_t next = 0;   ///< number that the next pulse will have
    std::int64_t latest = 0;  ///< time of the latest pulse before the end; INT64_MIN of none
  };
  /// The pulses of the times \p from to \p to, ns on the clock, both included.
  Answer between(std::int64_t from, std::int64_t to) const;

 private:
  mutable std::mutex mutex_;         // protects the following; held for microseconds
  std::vector<std::int64_t> times_;  // a ring: that of number n is at n % capacity
  std::uint64_t first_ = 0, next_ = 0;
  std::uint64_t round_ = 0;
};

}  // namespace polyhull
