// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which triangles are seen at all in some parts of a band of rows, and which parts show one triangle and
/// nothing else: most of a room's picture is walls and floor, before which little stands and behind which
/// nothing need be drawn.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "raster/raster_loops.h"

namespace polyhull {

/// Blocks of \p width columns side by side, all rows of a band high. Every triangle that is drawn there is
/// given to cover(), and then every one to show().
class CoveredBlocks {
 public:
  static constexpr int width = 32;

  /// A triangle that may be seen in blocks \p first to \p last.
  struct Shown {
    std::uint32_t number;
    int first, last;
  };

  /// Forgets all, and begins with the blocks of columns \p left to \p right - 1 and rows \p top to
  /// \p bottom - 1; the last one may be narrower.
  void begin(int left, int right, int top, int bottom);

  /// Looks which blocks \p triangle, which draw_packed() would name \p number, covers.
  void cover(const ScreenTriangle& triangle, std::uint32_t number);

  /// Looks in which blocks \p triangle may be seen, that is, not behind one that covers them.
  void show(const ScreenTriangle& triangle, std::uint32_t number);

  /// The triangle that covers every sample of block \p block and is nearer there than all others,
  /// so that draw_packed() leaves its number at each; no_triangle: there may be none.
  std::uint32_t alone(std::size_t block) const {
    const Block& of = blocks_[block];
    return of.others ? no_triangle : of.number;
  }

  /// In the order of show(): without the others draw_packed() leaves the same.
  const std::vector<Shown>& shown() const { return shown_; }

 private:
  /// Of the triangles that cover a block the one whose least 1/z there is the largest.
  struct Block {
    std::uint32_t number = no_triangle;
    bool others = false;  ///< may be seen, too
    double farthest = 0.0;
    ScreenPlane inverse;
  };
  std::pair<int, int> touched(const ScreenTriangle& triangle) const;

  int left_ = 0, right_ = 0, top_ = 0, bottom_ = 0;
  std::vector<Block> blocks_;
  std::vector<Shown> shown_;
};

}  // namespace polyhull
