// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/subject_instant.h"

#include <algorithm>

namespace polyhull {
namespace {

// Cameras of one stage drift apart by what the queues behind them hold.
constexpr std::size_t kept_instants = 8;

}  // namespace

const SubjectFrame& SubjectInstant::surface() const {
  std::call_once(posed_, [&] { subject_.pose(seconds_, surface_); });
  return surface_;
}

const FloorShadow& SubjectInstant::shadow() const {
  std::call_once(cast_, [&] { shadow_.emplace(surface(), subject_.triangles()); });
  return *shadow_;
}

std::shared_ptr<const SubjectInstant> Subject::instant(double seconds) const {
  const std::lock_guard lock(instants_mutex_);
  const auto found = std::find_if(instants_.begin(), instants_.end(), [&](const auto& instant) {
    return instant->seconds() == seconds;
  });
  if (found != instants_.end()) return *found;
  if (instants_.size() == kept_instants) instants_.erase(instants_.begin());
  instants_.push_back(std::make_shared<const SubjectInstant>(*this, seconds));
  return instants_.back();
}

}  // namespace polyhull
