// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/pace.h"

#include <algorithm>

#include "base/nanoseconds.h"

namespace polyhull {
namespace {

constexpr std::int64_t judged_at_least = second / 2;  // time, and
constexpr int judged_instants = 12;                   // instants before a judgement
constexpr int largest_share = 5;                      // one in so many may be lost
constexpr std::int64_t first_patience = 2 * second, last_patience = 16 * second;
constexpr std::int64_t settling = second;        // until what had piled up is gone
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
  if (largest_share * lost_ > instants_) clean_ = time;
  if (step_ > 1 && time - clean_ >= patience_) {
    step_ /= 2;
    trial_ = clean_ = time;
    start_counting(time);
    return true;
  }
  if (instants_ < judged_instants || time - begin_ < judged_at_least) return false;
  const bool too_many = largest_share * lost_ > instants_;
  start_counting(time);
  const bool tried = trial_ >= 0;
  const bool trial_over = tried && time - trial_ > trial_time;
  if (too_many && step_ < largest_step) {
    patience_ = tried && !trial_over ? std::min(2 * patience_, last_patience) : first_patience;
    trial_ = -1;
    clean_ = time;
    step_ *= 2;
    start_counting(time + settling);
    return true;
  }
  if (trial_over) trial_ = -1;
  return false;
}

}  // namespace polyhull
