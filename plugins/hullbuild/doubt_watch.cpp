// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/doubt_watch.h"

#include <gst/gst.h>

#include <algorithm>
#include <utility>

namespace polyhull::element {
namespace {

constexpr std::int64_t window = GST_SECOND;

}  // namespace

void DoubtWatch::add(std::int64_t now, const std::vector<std::string>& cameras,
                     CameraDoubts doubts) {
  const bool fits = cameras == cameras_ && (entries_.empty() || entries_.back().time <= now);
  if (!fits) {
    entries_.clear();
    cameras_ = cameras;
  }
  if (entries_.empty()) {
    sum_ = doubts;
  } else {
    sum_ += doubts;
  }
  entries_.push_back({now, std::move(doubts)});
  while (entries_.front().time <= now - window) {
    sum_ -= entries_.front().doubts;
    entries_.pop_front();
  }
}

Contradiction DoubtWatch::contradiction() const {
  if (entries_.empty()) return {};
  const int camera = doubtful_camera(sum_);
  Contradiction contradiction;
  contradiction.share = sum_.share_unexplained();
  if (camera >= 0) contradiction.camera = cameras_[static_cast<std::size_t>(camera)];
  if (contradiction.share < contradictory) return contradiction;
  for (const std::size_t view : views_with_background(sum_))
    contradiction.background.push_back({cameras_[view], sum_.where[view]});
  return contradiction;
}

bool DoubtWatch::others_are_sound(const std::string& camera) const {
  const auto found = std::find(cameras_.begin(), cameras_.end(), camera);
  if (entries_.empty() || found == cameras_.end()) return false;
  const std::size_t number[] = {static_cast<std::size_t>(found - cameras_.begin())};
  return sum_.share_unexplained(number) <= sound_share;
}

}  // namespace polyhull::element
