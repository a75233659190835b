// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/edge_map.h"

#include <algorithm>

#include "silhouette/pixels/kernels.h"
#include "silhouette/pixels/thread_memory.h"

namespace polyhull::silhouette {
namespace {

struct Interpolated {
  std::vector<std::int16_t> cells;   // between two rows of them
  std::vector<std::int16_t> pixels;  // from the first cell's centre on
};

constexpr std::uint8_t solid_from = 192;  // alpha: a face that is nearly solid is no edge

}  // namespace

void EdgeMap::begin(int width, int height) {
  width_ = width, height_ = height;
  shift_ = height < 360 ? 1 : height < 720 ? 2 : height <= 1440 ? 3 : 4;
  static_assert(matte_block == 16, "whole cells in a block");
  across_ = ((width - 1) >> shift_) + 1, down_ = ((height - 1) >> shift_) + 1;
  sum_.assign(static_cast<std::size_t>(blocks_across(width) * (matte_block >> shift_)), 0);
  touched_ = {across_, 0};
  open_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  smooth_.resize(open_.size());
  not_open_.resize(static_cast<std::size_t>(down_));
  solid_.resize(static_cast<std::size_t>(down_));
}

void EdgeMap::add_row(int y, const std::uint8_t* alpha, const BlockState* states) {
  constexpr std::uint64_t all_empty = 0x0101010101010101u * block_empty;
  const int blocks = blocks_across(width_), size = 1 << shift_;
  for (int block = 0; block < blocks; ++block) {
    if (block + 8 <= blocks && eight_states(states + block) == all_empty) {
      block += 7;
      continue;
    }
    if (states[block] == block_empty) continue;
    const int first = block * matte_block, columns = std::min(matte_block, width_ - first);
    touched_.begin = std::min(touched_.begin, first >> shift_);
    touched_.end = std::max(touched_.end, ((first + columns - 1) >> shift_) + 1);
    if (states[block] == block_full && columns == matte_block) {
      for (int cell = first >> shift_; cell < (first + columns) >> shift_; ++cell)
        sum_[static_cast<std::size_t>(cell)] += static_cast<std::uint32_t>(solid_from) << shift_;
      continue;
    }
    for (int x = first; x < first + columns; x += size) {
      std::uint32_t sum = 0;
      for (int i = x; i < std::min(x + size, first + columns); ++i)
        sum += std::min(alpha[i], solid_from);
      sum_[static_cast<std::size_t>(x >> shift_)] += sum;
    }
  }
  const int rows = (y & (size - 1)) + 1;
  if (rows == size || y == height_ - 1) finish_cells(y >> shift_, rows);
}

void EdgeMap::finish_cells(int row, int rows) {
  const auto open_at = [&](int i) -> int {
    i = std::clamp(i, 0, across_ - 1);
    if (sum_[static_cast<std::size_t>(i)] == 0) return all;  // as most are
    const int columns = std::min(1 << shift_, width_ - (i << shift_));
    const auto solid = static_cast<std::uint32_t>(solid_from * columns * rows);
    return static_cast<int>((solid - sum_[static_cast<std::size_t>(i)]) * std::uint32_t{all} /
                            solid);
  };
  std::int16_t* open = row_of(open_, row);
  const bool any = touched_.begin < touched_.end;
  const Stretch some = not_open_[static_cast<std::size_t>(row)] =
      any ? Stretch{std::max(touched_.begin - 1, 0), std::min(touched_.end + 1, across_)}
          : Stretch{across_, 0};
  std::fill(open, open + some.begin, all);
  int left = any ? open_at(some.begin - 1) : 0, here = any ? open_at(some.begin) : 0;
  for (int i = some.begin; i < some.end; ++i) {
    const int right = open_at(i + 1);
    open[i] = static_cast<std::int16_t>((left + 2 * here + right) / 4);
    left = here, here = right;
  }
  std::fill(open + some.end, open + across_, all);
  if (any) std::fill(sum_.begin() + touched_.begin, sum_.begin() + touched_.end, 0);
  touched_ = {across_, 0};
  // With it the row above has both its neighbours; the last one has none below.
  if (row > 0) smooth_down(row - 1);
  if (row == down_ - 1) smooth_down(row);
}

void EdgeMap::smooth_down(int row) {
  const std::int16_t *above = row_of(open_, row - 1), *here = row_of(open_, row),
                     *below = row_of(open_, row + 1);
  std::int16_t* smooth = row_of(smooth_, row);
  Stretch& solid = solid_[static_cast<std::size_t>(row)] = {across_, 0};
  for (int k = std::max(row - 1, 0); k <= std::min(row + 1, down_ - 1); ++k) {
    const Stretch& some = not_open_[static_cast<std::size_t>(k)];
    solid = {std::min(solid.begin, some.begin), std::max(solid.end, some.end)};
  }
  std::fill(smooth, smooth + solid.begin, all);
  for (int i = solid.begin; i < solid.end; ++i)
    smooth[i] = static_cast<std::int16_t>((above[i] + 2 * here[i] + below[i]) / 4);
  std::fill(smooth + solid.end, smooth + across_, all);
  while (solid.begin < solid.end && smooth[solid.begin] == all) ++solid.begin;
  while (solid.end > 0 && smooth[solid.end - 1] == all) --solid.end;
}

void EdgeMap::weigh_row(int y, int x0, int x1, std::int16_t* weights) const {
  // In half pixels: pixels lie at odd places, cells' centres at even ones, `whole` apart.
  const int whole = 2 << shift_, half = whole / 2;
  const int above = (2 * y + 1 - half) >> (shift_ + 1);
  const auto part = static_cast<std::int16_t>(((2 * y + 1 - half) & (whole - 1)) * (32768 / whole));
  const int upper_row = std::clamp(above, 0, down_ - 1);
  const int lower_row = std::clamp(above + 1, 0, down_ - 1);
  const std::int16_t *upper = row_of(smooth_, upper_row), *lower = row_of(smooth_, lower_row);
  // Only between the centres of the cells beside those that are not open all is there something to
  // interpolate.
  const Stretch &one = solid_[static_cast<std::size_t>(upper_row)],
                &other = solid_[static_cast<std::size_t>(lower_row)];
  const auto centre = [&](int cell) { return (cell * whole + half) / 2; };
  const int first =
      std::max(std::min(one.begin, other.begin) - 1, (2 * x0 + 1 - half) >> (shift_ + 1));
  const int last =
      std::min(std::max(one.end, other.end), ((2 * x1 - 1 - half) >> (shift_ + 1)) + 1);
  if (first >= last) return void(std::fill(weights, weights + (x1 - x0), all));

  auto& [cells, pixels] = kept_by_thread<Interpolated>();
  cells.resize(static_cast<std::size_t>(last - first) + 1);
  for (int i = first; i <= last; ++i) {
    const auto at = static_cast<std::size_t>(std::clamp(i, 0, across_ - 1));
    const auto step = static_cast<std::int16_t>(lower[at] - upper[at]);
    cells[static_cast<std::size_t>(i - first)] =
        static_cast<std::int16_t>(upper[at] + ((step * part) >> 15));
  }
  pixels.resize(static_cast<std::size_t>(last - first) << shift_);
  kernels().spread_cells(cells.data(), last - first, shift_, pixels.data());
  const int from = centre(first), begin = std::max(from, x0), end = std::min(centre(last), x1);
  std::fill(weights, weights + (begin - x0), all);
  std::copy(pixels.data() + (begin - from), pixels.data() + (end - from), weights + (begin - x0));
  std::fill(weights + (end - x0), weights + (x1 - x0), all);
}

}  // namespace polyhull::silhouette
