// SPDX-License-Identifier: LGPL-2.1-or-later
#include "trigger/frame_matcher.h"

namespace polyhull {

FrameMatcher::FrameMatcher(const PulseTable& table) {
  const PulseTable::Answer now = table.between(INT64_MAX, INT64_MAX);
  round_ = now.round;
  next_ = now.next;
}

FrameMatcher::Match FrameMatcher::match(const PulseTable& table, std::int64_t time,
                                        const FrameMatchSettings& settings) {
  const std::int64_t to = time - settings.delay;
  const PulseTable::Answer pulses = table.between(to - settings.window, to);
  if (pulses.round != round_) {
    round_ = pulses.round;
    next_ = 0;
    last_ = nobody;
  }
  Match match;
  if (pulses.latest != INT64_MIN) match.after = time - pulses.latest;
  // Windows of equal length end in the order of their pulses: those before `begin` are over.
  std::uint64_t over = pulses.begin;
  if (pulses.count > 1) {
    match.kind = Kind::ambiguous;
  } else if (pulses.count == 1 && pulses.begin >= next_) {
    match = {Kind::numbered, pulses.begin, time - pulses.time};
    unanswered_ += pulses.begin - next_;
    last_ = pulses.begin;
    next_ = over = pulses.begin + 1;
  } else if (pulses.count == 1 && pulses.begin == last_) {
    match = {Kind::repeated, pulses.begin, time - pulses.time};
  }
  if (over > next_) {
    unanswered_ += over - next_;
    next_ = over;
  }
  return match;
}

std::uint64_t FrameMatcher::unanswered(const PulseTable& table, std::int64_t now,
                                       std::int64_t patience,
                                       const FrameMatchSettings& settings) const {
  const std::int64_t from = now - patience - settings.delay - settings.window;
  const PulseTable::Answer pulses = table.between(from, INT64_MAX);
  const bool same = pulses.round == round_;
  const std::uint64_t next = same ? next_ : 0;
  return unanswered_ + (pulses.begin > next ? pulses.begin - next : 0);
}

}  // namespace polyhull
