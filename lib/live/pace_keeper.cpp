// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/pace_keeper.h"

#include <algorithm>

namespace polyhull {
namespace {

/// Sources draw up to a frame ahead: what they have begun they may finish.
constexpr std::int64_t lead = 100'000'000;

}  // namespace

void PaceFilter::hear(const PaceChange& change) {
  const std::scoped_lock lock(mutex_);
  grids_.change(change.grid, change.from);
  patience_ = change.patience;
}

bool PaceFilter::wanted(std::int64_t time, std::int64_t now) const {
  if (time == INT64_MIN) return true;
  const std::scoped_lock lock(mutex_);
  if (now != INT64_MIN && patience_ != INT64_MAX && now - time > patience_) return false;
  return grids_.wanted(time);
}

void PaceFilter::reset() {
  const std::scoped_lock lock(mutex_);
  grids_.reset();
  patience_ = INT64_MAX;
}

void PaceKeeper::start() {
  pace_.reset();
  earliest_ = INT64_MIN;
  const std::scoped_lock lock(mutex_);
  own_ = downstream_ = FrameGrid();
  grids_.reset();
  now_.grid = FrameGrid();
  now_.from = INT64_MIN;  // at once, whatever running time is from here on
  kept_ = INT64_MIN;
  ++version_;
}

void PaceKeeper::set_patience(std::int64_t patience) {
  const std::scoped_lock lock(mutex_);
  if (now_.patience == patience) return;
  now_.patience = patience;
  ++version_;
}

void PaceKeeper::hear(const PaceChange& change) {
  const std::scoped_lock lock(mutex_);
  downstream_ = change.grid;
  follow(change.from);
}

bool PaceKeeper::wanted(std::int64_t time) const {
  const std::scoped_lock lock(mutex_);
  return grids_.wanted(time);
}

void PaceKeeper::note(std::int64_t now, std::int64_t time, std::int64_t interval, bool lost) {
  if (interval <= 0) return;
  if (!lost) kept_ = time;
  if (!pace_.note(time, lost)) return;
  const std::scoped_lock lock(mutex_);
  // A camera that is slow by half has sent what was kept.
  own_ = {kept_ != INT64_MIN ? kept_ : time, interval, pace_.step()};
  follow(std::max(time, now) + 2 * interval + lead);
}

void PaceKeeper::follow(std::int64_t from) {
  const bool own = own_.step > 1 && (downstream_.step <= 1 || own_.period() > downstream_.period());
  const FrameGrid& grid = own ? own_ : downstream_;
  if (grid == now_.grid) return;
  grids_.change(grid, from);
  now_.grid = grid;
  now_.from = from;
  ++version_;
}

PaceChange PaceKeeper::change(std::uint64_t& version) const {
  const std::scoped_lock lock(mutex_);
  version = version_;
  return now_;
}

std::uint64_t PaceKeeper::step() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::uint64_t>(now_.grid.step);
}

}  // namespace polyhull
