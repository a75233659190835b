// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which parts of a band of rows show one triangle and nothing else, so that nobody need look at their
/// samples: most of a room's pictures is walls and floor.
#pragma once

#include <vector>

#include "raster/raster_loops.h"

namespace polyhull {

/// Blocks of \p width columns side by side, all rows of a band high. Add every triangle that is drawn
/// there, in any order.
class CoveredBlocks {
 public:
  static constexpr int width = 32;

  /// Forgets all, and begins with the blocks of columns \p left to \p right - 1 and rows \p top to
  /// \p bottom - 1; the last one may be narrower.
  void begin(int left, int right, int top, int bottom);

  /// Adds \p triangle, which draw_packed() would name \p number.
  void add(const ScreenTriangle& triangle, std::uint32_t number);

  /// The triangle that covers every sample of block \p block and is nearer there than all others,
  /// so that draw_packed() leaves its number at each; no_triangle: there may be none.
  std::uint32_t alone(std::size_t block) const {
    const Block& of = blocks_[block];
    return of.farthest > of.others ? of.number : no_triangle;
  }

 private:
  /// The nearest of the triangles that cover a block: of its 1/z the least and the largest; and the
  /// largest that others may have.
  struct Block {
    double farthest = 0.0, nearest = 0.0, others = 0.0;
    std::uint32_t number = no_triangle;
  };
  int left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
  std::vector<Block> blocks_;
};

}  // namespace polyhull
