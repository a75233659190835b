// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/frame_schedule.h"

#include <algorithm>

#include "base/nanoseconds.h"

namespace polyhull {
namespace {

__extension__ typedef unsigned __int128 Uint128;

/// a b / c, rounded down.
std::uint64_t scale(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return static_cast<std::uint64_t>(static_cast<Uint128>(a) * b / c);
}

/// A number that looks random, the same for the same arguments (splitmix64, Steele et al. 2014).
std::uint64_t scatter(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15u;
  value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9u;
  value = (value ^ (value >> 27)) * 0x94D049BB133111EBu;
  return value ^ (value >> 31);
}

}  // namespace

std::int64_t FrameDelay::of(std::uint64_t number) const {
  if (jitter == 0) return static_cast<std::int64_t>(delay);
  const double unit = static_cast<double>(scatter(scatter(seed) + number) >> 11) * 0x1p-53;
  const auto moved = static_cast<std::int64_t>((2.0 * unit - 1.0) * static_cast<double>(jitter));
  return std::max<std::int64_t>(static_cast<std::int64_t>(delay) + moved, 0);
}

std::uint64_t FrameSchedule::time_of(std::uint64_t number) const {
  return scale(number, std::uint64_t{second} * rate_d_, rate_n_);
}

std::uint64_t FrameSchedule::number_at(std::uint64_t time) const {
  return scale(time, rate_n_, std::uint64_t{second} * rate_d_);
}

void FrameSchedule::set_rate(int numerator, int denominator) {
  const std::uint64_t time = rate_n_ > 0 ? time_of(next_) : sought_;
  rate_n_ = numerator;
  rate_d_ = denominator;
  // The first frame that does not begin before.
  next_ = number_at(time);
  while (time_of(next_) < time) ++next_;
}

void FrameSchedule::seek(std::uint64_t position) {
  sought_ = position;
  if (rate_n_ == 0) return;
  next_ = number_at(sought_);
  if (time_of(next_ + 1) <= sought_) ++next_;
}

FrameSchedule::Frame FrameSchedule::next(
    std::int64_t now, std::uint64_t delay, const FrameGrids* grids,
    const std::function<std::int64_t(std::uint64_t)>& running_time) const {
  Frame frame;
  frame.number = next_;
  const std::int64_t begin = running_time(next_);
  if (now != INT64_MIN && begin != INT64_MIN) {
    const auto interval = static_cast<std::int64_t>(time_of(1));
    const std::int64_t behind = now - begin - static_cast<std::int64_t>(delay);
    // Half a frame at the start, when all sources still have the choice; later a whole one.
    if (behind > (first_ ? interval / 2 : interval)) {
      frame.late = static_cast<std::uint64_t>((behind + interval - 1) / interval);
      // To a number that others who are late meet, too.
      std::uint64_t step = 1;
      while (!first_ && step < frame.late && step < 8) step *= 2;
      frame.number = (next_ + frame.late + step - 1) / step * step;
      frame.late = frame.number - next_;
    }
  }
  while (grids != nullptr && frame.unwanted < 64 && !grids->wanted(running_time(frame.number))) {
    ++frame.number;
    ++frame.unwanted;
  }
  if (first_) frame.late = 0;  // nobody has missed them
  frame.time = time_of(frame.number);
  frame.duration = time_of(frame.number + 1) - frame.time;
  return frame;
}

void FrameSchedule::finish(std::uint64_t number) {
  next_ = number + 1;
  first_ = false;
}

}  // namespace polyhull
