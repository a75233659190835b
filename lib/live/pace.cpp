// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/pace.h"

#include <algorithm>

namespace polyhull {
namespace {

constexpr std::int64_t second = 1'000'000'000;
constexpr std::int64_t judged_at_least = second / 2;  // time, and
constexpr int judged_instants = 6;                    // instants before a judgement
constexpr std::int64_t first_patience = 2 * second, last_patience = 64 * second;
constexpr std::int64_t trial_time = 3 * second;  // in which a trial shows whether it fails

}  // namespace

void Pace::start_counting(std::int64_t time) {
  begin_ = time;
  instants_ = lost_ = 0;
}

bool Pace::note(std::int64_t time, bool lost) {
  if (!started_) {
    started_ = true;
    clean_ = time + second;
    start_counting(time + second);
  }
  if (time < begin_) return false;
  ++instants_;
  lost_ += lost;
  if (lost) clean_ = time;
  if (step_ > 1 && time - clean_ >= patience_) {
    step_ /= 2;
    trial_ = clean_ = time;
    start_counting(time);
    return true;
  }
  if (instants_ < judged_instants || time - begin_ < judged_at_least) return false;
  const bool too_many = 8 * lost_ > instants_;
  start_counting(time);
  const bool tried = trial_ >= 0;
  const bool trial_over = tried && time - trial_ > trial_time;
  if (too_many && step_ < largest_step) {
    patience_ = tried && !trial_over ? std::min(2 * patience_, last_patience) : first_patience;
    trial_ = -1;
    clean_ = time;
    step_ *= 2;
    return true;
  }
  if (trial_over) trial_ = -1;
  return false;
}

}  // namespace polyhull
