// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The keyed matte of a frame, for the pixels of a view: only the states of the blocks and the
/// values of the mixed ones, which are a tenth of a plane and stay in the caches. Internal.
#pragma once

#include <cstdint>
#include <vector>

#include "silhouette/pixels/matte.h"

namespace polyhull::silhouette {

class KeptMatte {
 public:
  /// Before the first row of a frame.
  void begin(int width, int height);
  /// The next row of the matte, top to bottom; whole blocks.
  void add_row(const std::uint8_t* alpha, const BlockState* states);
  /// A matte whose every row is row \p y. Valid until the next call.
  const Matte& row(int y);

 private:
  int width_ = 0, blocks_ = 0;
  std::vector<BlockState> states_;    // blocks_ per row
  std::vector<std::size_t> begins_;   // of each row's values
  std::vector<std::uint8_t> values_;  // of mixed blocks
  std::size_t used_ = 0;              // of values_
  std::vector<std::uint16_t> mixed_;  // of one row
  Matte row_;
};

}  // namespace polyhull::silhouette
