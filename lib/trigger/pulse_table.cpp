// SPDX-License-Identifier: LGPL-2.1-or-later
#include "trigger/pulse_table.h"

#include <algorithm>

namespace polyhull {

void PulseTable::add(const Pulse& pulse) {
  const std::scoped_lock lock(mutex_);
  times_.resize(capacity);
  if (first_ == next_) first_ = pulse.number;
  next_ = pulse.number + 1;
  first_ = std::max(first_, next_ - std::min<std::uint64_t>(next_, capacity));
  times_[pulse.number % capacity] = pulse.time;
}

void PulseTable::withdraw() {
  const std::scoped_lock lock(mutex_);
  if (next_ > first_) --next_;
}

void PulseTable::begin_round() {
  const std::scoped_lock lock(mutex_);
  first_ = next_ = 0;
  ++round_;
}

PulseTable::Answer PulseTable::between(std::int64_t from, std::int64_t to) const {
  const std::scoped_lock lock(mutex_);
  Answer answer{round_, next_, 0, 0, next_, INT64_MIN};
  // From the latest back: what is asked for is there, and a clock that was set may have left times
  // out of order.
  for (std::uint64_t n = next_; n > first_; --n) {
    const std::int64_t time = times_[(n - 1) % capacity];
    if (time > to) {
      answer.begin = n - 1;
      continue;
    }
    if (answer.latest == INT64_MIN) answer.latest = time;
    if (time < from) break;
    answer.begin = n - 1;
    answer.time = time;
    ++answer.count;
  }
  return answer;
}

}  // namespace polyhull
