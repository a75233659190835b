// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/adaptive_tolerance.h"

#include <algorithm>
#include <cmath>

#include "base/nanoseconds.h"

namespace polyhull {
namespace {

constexpr std::int64_t window = second / 2;
constexpr std::int64_t shortest_wait = 2 * second;
constexpr std::int64_t longest_wait = 64 * second;
constexpr double upper_load = 1.0;
constexpr double heavy_load = 2.0;
constexpr double lower_load = 0.7;

}  // namespace

void AdaptiveTolerance::begin_window(std::int64_t time) {
  window_begin_ = time;
  sum_ = 0.0;
  count_ = 0;
}

void AdaptiveTolerance::step_up(int steps, std::int64_t time) {
  if (last_down_ != INT64_MIN && time - last_down_ < 2 * wait_)
    wait_ = std::min(2 * wait_, longest_wait);
  last_down_ = INT64_MIN;
  calm_since_ = INT64_MIN;
  level_ = std::min(level_ + steps, highest_level);
}

void AdaptiveTolerance::step_down(std::int64_t time) {
  last_down_ = time;
  calm_since_ = time;
  level_ -= 1;
}

void AdaptiveTolerance::observe(double load, std::int64_t time) {
  if (!std::isfinite(load) || load <= 0.0) return;
  if (window_begin_ == INT64_MIN || time < window_begin_) {
    begin_window(time);
    calm_since_ = INT64_MIN;
    last_down_ = INT64_MIN;
  }
  sum_ += load;
  ++count_;
  if (time - window_begin_ < window) return;

  const double mean = sum_ / count_;
  if (last_down_ != INT64_MIN && time - last_down_ >= 2 * wait_) {
    last_down_ = INT64_MIN;
    wait_ = std::max(wait_ / 2, shortest_wait);
  }
  if (mean > upper_load)
    step_up(mean > heavy_load ? 2 : 1, time);
  else if (mean >= lower_load || level_ == 0)
    calm_since_ = INT64_MIN;
  else if (calm_since_ == INT64_MIN)
    calm_since_ = window_begin_;
  if (calm_since_ != INT64_MIN && time - calm_since_ >= wait_) step_down(time);
  begin_window(time);
}

double AdaptiveTolerance::tolerance(double base) const {
  return base * std::exp2(0.5 * level_);
}

}  // namespace polyhull
