// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a Blur holds, which takes a matte row by row. Internal.
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "silhouette/blur/blur.h"
#include "silhouette/blur/blur_plane.h"
#include "silhouette/pixels/row_ahead.h"

namespace polyhull {

/// A row kept in a ring, with room on both sides.
template <typename T>
class RowRing {
 public:
  void resize(int rows, std::ptrdiff_t length, std::ptrdiff_t pad) {
    rows_ = static_cast<int>(std::bit_ceil(static_cast<unsigned>(rows)));
    pad_ = pad;
    stride_ = (length + 2 * pad + 31) / 32 * 32;
    values_.resize(static_cast<std::size_t>(stride_) * rows_);
  }
  T* row(int y) { return values_.data() + pad_ + stride_ * (y & (rows_ - 1)); }
  void clear(T value) { std::fill(values_.begin(), values_.end(), value); }

 private:
  int rows_ = 1;
  std::ptrdiff_t pad_ = 0, stride_ = 0;
  std::vector<T> values_;
};

struct Blur::State {
  /// As Blur::set().
  void set(const BlurSettings& settings);

  /// True when rows can be pushed one after the other (fir, or no blur); else only apply() will do.
  bool streams() const { return settings.method == BlurMethod::fir || settings.sigma == 0.0; }

  /// Starts a picture of \p height rows for pushing. The last \p keep rows pulled stay valid.
  void begin(int width, int height, int keep);

  /// Room for the next row: alpha (whole blocks, zero beyond the width) and its states; then
  /// push().
  std::uint8_t* next_alpha() { return alpha.row(pushed); }
  BlockState* next_states() { return alpha_states.row(pushed); }
  void push();

  struct Row {
    const std::int16_t* values;  ///< with field_pad values on both sides
    const BlockState* states;
  };
  /// The next finished row; false when more rows must be pushed first, or all have been pulled.
  /// \p ahead: what is asked from memory meanwhile.
  bool pull(Row& row, silhouette::RowAhead* ahead);

  /// As Blur::apply().
  void apply(const Matte& matte, Field& field);

  BlurSettings settings;
  bool fresh = true;

  int radius = 0;
  std::vector<std::int16_t> weights;

  // The picture being pushed.
  int width = 0, height = 0, blocks = 0;
  int pushed = 0, pulled = 0;
  silhouette::RowAhead* ahead = nullptr;  // of the row being pulled
  RowRing<std::uint8_t> alpha;
  RowRing<BlockState> alpha_states;
  RowRing<std::int16_t> out;
  RowRing<BlockState> out_states;
  std::vector<std::int16_t> vertical;  // one row with `side` values on both sides
  int side = 0;
  std::vector<RowRing<BlockState>> unions;  // see push()
  int side_blocks = 0;                      // that the radius reaches
  std::vector<BlockState> column_states;    // over the window of rows, 0 beside the row
  std::vector<BlockState> reached_states;   // over all that the filter reaches
  std::vector<BlockState> vertical_states;  // what the blocks of `vertical` hold
  std::vector<std::uint16_t> mixed_out, mixed_columns;
  std::vector<const std::uint8_t*> window;

  silhouette::PlaneBlur plane;  // box and recursive

  // One finished row; states tells before what the memory of values holds.
  template <typename Rows>
  void blur_row(int y, const Rows& alpha_row, std::int16_t* values, BlockState* states);
  void copy_row(const std::uint8_t* alpha_row, int y, std::int16_t* values, BlockState* states);
  template <typename Rows>
  void finish_row(int y, const Rows& alpha_row, std::int16_t* values, BlockState* states);
  BlockState* states_level(int level, int y) {
    return level == 0 ? alpha_states.row(y) : unions[static_cast<std::size_t>(level) - 1].row(y);
  }
  // Sixteen at a time: rows of states have that room.
  using Sixteen = std::uint8_t __attribute__((vector_size(16)));
  void unite(const BlockState* a, const BlockState* b, BlockState* out) const {
    for (int i = 0, end = blocks; i < end; i += 16) {
      Sixteen one, other;
      std::memcpy(&one, a + i, sizeof one);
      std::memcpy(&other, b + i, sizeof other);
      one |= other;
      std::memcpy(out + i, &one, sizeof one);
    }
  }
  // Calls change(block) for each block whose state in `now` is not that in `before`.
  template <typename Change>
  void each_changed(const BlockState* now, const BlockState* before, const Change& change) const {
    const int end = blocks;
    int b = 0;
    for (; b + 8 <= end; b += 8)
      if (eight_states(now + b) != eight_states(before + b))
        for (int i = b; i < b + 8; ++i)
          if (now[i] != before[i]) change(i);
    for (; b < end; ++b)
      if (now[b] != before[b]) change(b);
  }
  void threshold_row(std::int16_t* values, BlockState* states) const;
};

}  // namespace polyhull
