// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/closed_gaps.h"

#include <cmath>

namespace polyhull::silhouette {
namespace {

// Alpha from which a pixel is of the subject alone, and from which it is more foreground than not.
constexpr int alone = 250, half = 128;
// By so much closing raises a pixel that it was not of the subject, or not alone.
constexpr int raised = 32;

}  // namespace

void ClosedGaps::open(const Matte& matte) {
  width_ = matte.width;
  height_ = matte.height;
  kinds_.clear();
  for (int y = 0; y < height_; ++y)
    kinds_.insert(kinds_.end(), matte.row(y), matte.row(y) + width_);
}

void ClosedGaps::close(const Matte& matte, double reach) {
  reach_ = static_cast<int>(std::ceil(2.0 * reach)) + 2;  // over the gap's soft edge
  has_gaps_.resize(static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    const std::uint8_t* row = matte.row(y);
    std::uint8_t* kinds =
        kinds_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
    std::uint8_t any = 0;
    for (int x = 0; x < width_; ++x) {
      const int before = kinds[x], after = row[x];
      const std::uint8_t gap = (after >= half) & (after - before >= raised);
      kinds[x] = before >= alone ? solid : gap;
      any |= gap;
    }
    has_gaps_[static_cast<std::size_t>(y)] = any;
  }
}

std::array<ClosedGaps::Neighbour, 4> ClosedGaps::around(int x, int y) const {
  constexpr int directions[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
  std::array<Neighbour, 4> found;
  for (std::size_t i = 0; i < found.size(); ++i) {
    int px = x, py = y;
    for (int distance = 1; distance <= reach_; ++distance) {
      px += directions[i][0], py += directions[i][1];
      if (px < 0 || py < 0 || px >= width_ || py >= height_) break;
      if (kind(px, py) != solid) continue;
      found[i] = {px, py, distance};
      break;
    }
  }
  return found;
}

}  // namespace polyhull::silhouette
