// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/pixels/matte.h"

#include <algorithm>

#include "silhouette/pixels/kernels.h"

namespace polyhull {

void Matte::resize(int new_width, int new_height) {
  width = new_width;
  height = new_height;
  const int blocks = blocks_across(width);
  stride = static_cast<std::ptrdiff_t>(blocks) * matte_block;
  values.resize(static_cast<std::size_t>(stride) * height);
  states.resize(static_cast<std::size_t>(blocks) * height + sizeof(std::uint64_t));
}

void Field::resize(int new_width, int new_height) {
  if (width == new_width && height == new_height) return;
  width = new_width;
  height = new_height;
  const int blocks = blocks_across(width);
  stride = static_cast<std::ptrdiff_t>(blocks) * matte_block + 2 * field_pad;
  values.resize(static_cast<std::size_t>(stride) * height);
  states.assign(static_cast<std::size_t>(blocks) * height, block_mixed);
}

void Field::pad_row(int y) {
  std::int16_t* values_row = row(y);
  std::fill(values_row - field_pad, values_row, values_row[0]);
  std::fill(values_row + width, values_row + stride - field_pad, values_row[width - 1]);
}

void find_states(const std::uint8_t* row, int width, BlockState* states) {
  const int whole = width / matte_block;
  silhouette::kernels().states(row, whole, states);
  if (whole * matte_block == width) return;
  BlockState state = 0;
  for (int x = whole * matte_block; x < width; ++x)
    state |= row[x] == 0 ? block_empty : row[x] == 255 ? block_full : block_mixed;
  states[whole] = state;
}

void load_matte(const std::uint8_t* first, std::ptrdiff_t stride, int step, int width, int height,
                Matte& matte) {
  matte.resize(width, height);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* from = first + stride * y;
    std::uint8_t* to = matte.row(y);
    if (step == 1)
      std::copy(from, from + width, to);
    else
      for (int x = 0; x < width; ++x) to[x] = from[static_cast<std::ptrdiff_t>(x) * step];
    std::fill(to + width, to + matte.stride, to[width - 1]);
    find_states(to, width, matte.state_row(y));
  }
}

void load_field(const Matte& matte, Field& field) {
  field.resize(matte.width, matte.height);
  for (int y = 0; y < matte.height; ++y) {
    const std::uint8_t* from = matte.row(y);
    std::int16_t* to = field.row(y);
    for (int x = 0; x < matte.width; ++x) to[x] = static_cast<std::int16_t>(from[x] * field_scale);
    field.pad_row(y);
  }
  field.states = matte.states;
}

namespace {

// Rounded to 8 bit, each through `shown`; the unit step is a loop of its own for the vectoriser.
template <typename Shown>
void store_levels(const std::int16_t* __restrict row, int width, std::uint8_t* __restrict out,
                  std::ptrdiff_t step, const Shown& shown) {
  const auto level = [](std::int16_t value) {
    return static_cast<std::uint8_t>(static_cast<std::uint16_t>(value + field_scale / 2) /
                                     static_cast<unsigned>(field_scale));
  };
  if (step == 1)
    for (int x = 0; x < width; ++x) out[x] = shown(level(row[x]));
  else
    for (int x = 0; x < width; ++x) out[x * step] = shown(level(row[x]));
}

}  // namespace

void store_field_row(const std::int16_t* row, int width, int threshold, std::uint8_t* out,
                     int step) {
  if (threshold <= 0) return store_levels(row, width, out, step, [](std::uint8_t v) { return v; });
  const auto least = static_cast<std::uint8_t>(std::min(threshold, 255));
  store_levels(row, width, out, step,
               [=](std::uint8_t v) { return static_cast<std::uint8_t>(v >= least ? 255 : 0); });
}

}  // namespace polyhull
