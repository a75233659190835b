// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Timecodes that a tracker gives its samples, and when poses were true by them.
#pragma once

#include <cstdint>
#include <optional>

namespace polyhull {

struct Timecode {
  static constexpr int most_rate = 1'000'000;  ///< of numerator and denominator

  int hours = 0, minutes = 0, seconds = 0, frames = 0;
  int numerator = 25, denominator = 1;  ///< of its frames per second
  /// Whether the count leaves numbers out, as it can at 30000/1001 frames per second and its multiples;
  /// none: nobody has told.
  std::optional<bool> drops;
  int part = 0, parts = 1;  ///< of how many parts of the frame it is which, from 0 on

  bool can_drop() const {
    return denominator == 1001 && (numerator == 30000 || numerator == 60000 || numerator == 120000);
  }
};

/// When the part of the frame begins, ns since midnight, rounded down; \p drops counts where the
/// timecode does not tell. None where there is no such timecode.
std::optional<std::int64_t> time_of(const Timecode& timecode, bool drops);

/// How long the part lasts, ns.
std::int64_t length_of(const Timecode& timecode);

/// Trackers send more often than there are frames: what follows under the same timecode was true as much
/// later as it came, within the frame.
class TimecodeSpread {
 public:
  /// When what came at \p arrival was true, whose timecode begins at \p time and lasts \p length. The
  /// first is true at \p time, each further one later than the one before.
  std::int64_t place(std::int64_t time, std::int64_t length, std::int64_t arrival);
  void forget() { time_.reset(); }

 private:
  std::optional<std::int64_t> time_;
  std::int64_t first_ = 0;  // when the first one came
  std::int64_t after_ = 0;  // how much later than it the last one was true
};

}  // namespace polyhull
