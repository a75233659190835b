// SPDX-License-Identifier: LGPL-2.1-or-later
#include "live/frame_grid.h"

namespace polyhull {
namespace {

/// Quotient rounded down; the divisor is above 0.
std::int64_t floor_divide(std::int64_t dividend, std::int64_t divisor) {
  const std::int64_t quotient = dividend / divisor;
  return dividend % divisor < 0 ? quotient - 1 : quotient;
}

}  // namespace

bool FrameGrid::wanted(std::int64_t time) const {
  if (interval <= 0 || step <= 1 || time == INT64_MIN) return true;
  const std::int64_t point = floor_divide(time - anchor + interval / 2, interval);
  return point % step == 0;
}

void FrameGrids::change(const FrameGrid& grid, std::int64_t from) {
  if (grid == after_ && from == from_) return;  // heard twice
  before_ = at(from);
  after_ = grid;
  from_ = from;
}

}  // namespace polyhull
