// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which pulse each frame of one camera answers to.
///
/// A frame whose time is t answers to the pulse at p if p + delay <= t <= p + delay + window: the
/// delay is what exposure, readout and transfer take at least, as far as the frame's time includes
/// them. Frames are matched by their times alone, never counted, so a lost frame or pulse shifts
/// nothing. Where no pulse explains a frame, two do, or the pulse has its frame, the frame gets
/// no number.
#pragma once

#include <cstdint>

#include "trigger/pulse_table.h"

namespace polyhull {

struct FrameMatchSettings {
  std::int64_t delay = 0;          ///< ns, at least 0
  std::int64_t window = 15000000;  ///< ns, at least 0
};

/// One camera's frames against a trigger's pulses. One thread at a time.
class FrameMatcher {
 public:
  enum class Kind {
    numbered,     ///< the frame answers to the pulse `number`
    unexplained,  ///< to none, or it comes after a frame of a later pulse
    repeated,     ///< to a pulse that has its frame
    ambiguous     ///< it lies in the windows of several pulses
  };
  struct Match {
    Kind kind = Kind::unexplained;
    std::uint64_t number = 0;  ///< of the pulse, where numbered or repeated
    /// The frame's time minus that of its pulse, ns; without one, minus that of the latest pulse
    /// before the frame; negative: there is none.
    std::int64_t after = -1;
  };

  /// Begins with the next pulse of \p table: those before are nobody's.
  explicit FrameMatcher(const PulseTable& table);

  /// The pulse of a frame of time \p time, ns on the pulses' clock.
  Match match(const PulseTable& table, std::int64_t time, const FrameMatchSettings& settings);

  /// How many pulses were left without a frame, as a later frame has shown; and with \p now, ns on
  /// the clock, those whose window ended more than \p patience ns ago.
  std::uint64_t unanswered() const { return unanswered_; }
  std::uint64_t unanswered(const PulseTable& table, std::int64_t now, std::int64_t patience,
                           const FrameMatchSettings& settings) const;

 private:
  static constexpr std::uint64_t nobody = ~std::uint64_t{0};

  std::uint64_t round_ = 0;
  std::uint64_t next_ = 0;       // the first pulse that may still get its frame
  std::uint64_t last_ = nobody;  // the last that got it
  std::uint64_t unanswered_ = 0;
};

}  // namespace polyhull
