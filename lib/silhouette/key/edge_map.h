// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How near each pixel lies to the matte's edge: where the screen's light falls on the subject, and
/// colours mix. Internal.
///
/// The share of pixels that are not solid is found for square cells, smoothed over three by three of
/// them (1, 2, 1) and interpolated linearly between their centres. Eight times that, 1 at most, is
/// the weight: at a straight edge 1 outside of the subject and up to a cell inside, and 0 from two and
/// a half cells on at the latest. Cells are 2 to 16 px wide, the larger the picture is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "silhouette/pixels/matte.h"

namespace polyhull::silhouette {

class EdgeMap {
 public:
  /// A new matte of this size, of which nothing is known yet.
  void begin(int width, int height);
  /// Row \p y of it; rows come from top to bottom.
  void add_row(int y, const std::uint8_t* alpha, const BlockState* states);

  /// So many rows below one must be known before it is weighed.
  int rows_below() const { return 5 << (shift_ - 1); }
  /// For columns [x0, x1) of row \p y: from 0, solid all around, to 32767, at the edge or outside.
  void weigh_row(int y, int x0, int x1, std::int16_t* weights) const;

 private:
  static constexpr std::int16_t all = 32767;
  /// Cells [begin, end) of a row, beside which all is open; `end` before `begin`: all of it is.
  struct Stretch {
    int begin = 0, end = 0;
  };
  void finish_cells(int row, int rows);
  void smooth_down(int row);
  /// Of a plane of cells; beyond its ends the last one.
  template <class Plane>
  auto* row_of(Plane& plane, int row) const {
    return plane.data() + static_cast<std::size_t>(std::clamp(row, 0, down_ - 1)) *
                              static_cast<std::size_t>(across_);
  }

  int width_ = 0, height_ = 0;
  int shift_ = 3;                     // of a cell's size
  int across_ = 0, down_ = 0;         // cells
  std::vector<std::uint32_t> sum_;    // solidity of the cells in the making
  std::vector<std::int16_t> open_;    // what is not solid of each cell, smoothed across, of `all`
  std::vector<std::int16_t> smooth_;  // the same, smoothed down as well
  Stretch touched_;                   // of sum_
  std::vector<Stretch> not_open_;     // of each row of open_
  std::vector<Stretch> solid_;        // of each row of smooth_
};

}  // namespace polyhull::silhouette
