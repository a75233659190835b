// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/steady_times.h"

#include <algorithm>

namespace polyhull {
namespace {

constexpr std::int64_t jump = 1'000'000'000;
/// What a stall may hold up; a clock that has fallen so far behind has begun anew.
constexpr std::int64_t longest_stall = 10'000'000'000;
/// So many frames that come late for so long are not held up.
constexpr std::int64_t longest_lateness = 10'000'000'000;
constexpr int most_late_frames = 20;
/// For so long frames that are even later are held up besides.
constexpr std::int64_t longest_hiccup = 3'000'000'000;

}  // namespace

void SteadyTimes::reset() {
  const std::uint64_t restarts = restarts_;
  *this = SteadyTimes();
  restarts_ = restarts;
}

void SteadyTimes::look_for_step(std::int64_t arrival, std::int64_t delay, std::int64_t step) {
  if (delay < delay_ + step) {
    late_since_.reset();
    return;
  }
  const bool later = late_since_ && delay > late_delay_ + step;
  if (later && arrival - late_last_ < longest_hiccup) return;
  if (!late_since_ || later) {
    late_since_ = arrival;
    late_frames_ = 0;
    late_delay_ = delay;
  }
  late_last_ = arrival;
  late_delay_ = std::min(late_delay_, delay);
  if (++late_frames_ < most_late_frames || arrival - *late_since_ < longest_lateness) return;
  delay_ = late_delay_;
  late_since_.reset();
  ++restarts_;
}

std::optional<SteadyTimes::Placed> SteadyTimes::place(std::int64_t time, std::int64_t arrival,
                                                      const Settings& settings) {
  const std::int64_t delay = arrival - time;
  if (begun_ && (time < last_ || delay < delay_ - jump || delay > delay_ + longest_stall)) {
    reset();
    ++restarts_;
  }
  if (!begun_) {
    begun_ = true;
    first_ = time;
    delay_ = delay;
  } else {
    const auto drift =
        static_cast<std::int64_t>(settings.drift * static_cast<double>(time - last_));
    delay_ = std::min(delay_ + drift, delay);
    look_for_step(arrival, delay, settings.step);
  }
  last_ = time;
  if (time - first_ < settings.settle) return std::nullopt;
  return Placed{time + delay_, delay - delay_};
}

}  // namespace polyhull
