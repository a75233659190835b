// SPDX-License-Identifier: LGPL-2.1-or-later
#include "track/timecode.h"

#include <algorithm>

#include "base/nanoseconds.h"

namespace polyhull {
namespace {

/// How long \p frames last. Rounded down as GStreamer does, so that a frame's own pose is its own to
/// the nanosecond.
std::int64_t time_of_frames(std::int64_t frames, const Timecode& rate) {
  const std::int64_t steps = frames * rate.denominator;
  return steps / rate.numerator * second + steps % rate.numerator * second / rate.numerator;
}

bool within(int value, int end) {
  return value >= 0 && value < end;
}

}  // namespace

std::optional<std::int64_t> time_of(const Timecode& t, bool drops) {
  const auto is_rate = [](int value) { return value >= 1 && value <= Timecode::most_rate; };
  // Of less than a frame a second no second has a frame 0.
  if (!is_rate(t.numerator) || !is_rate(t.denominator) || t.numerator < t.denominator ||
      t.parts < 1 || !within(t.part, t.parts))
    return {};
  const int nominal = (t.numerator + t.denominator - 1) / t.denominator;
  if (!within(t.hours, 24) || !within(t.minutes, 60) || !within(t.seconds, 60) ||
      !within(t.frames, nominal))
    return {};
  const int left_out = t.can_drop() && t.drops.value_or(drops) ? nominal / 15 : 0;  // each minute
  if (t.minutes % 10 != 0 && t.seconds == 0 && t.frames < left_out) return {};
  const std::int64_t minutes = 60 * t.hours + t.minutes;
  const std::int64_t frames =
      nominal * (60 * minutes + t.seconds) + t.frames - left_out * (minutes - minutes / 10);
  return time_of_frames(frames, t) + t.part * length_of(t);
}

std::int64_t length_of(const Timecode& timecode) {
  return time_of_frames(1, timecode) / timecode.parts;
}

std::int64_t TimecodeSpread::place(std::int64_t time, std::int64_t length, std::int64_t arrival) {
  if (time_ != time) {
    time_ = time;
    first_ = arrival;
    after_ = 0;
  } else {
    after_ = std::max(after_ + 1, std::min(arrival - first_, length - 1));
  }
  return time + after_;
}

}  // namespace polyhull
