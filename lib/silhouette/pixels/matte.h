// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The matte before and after blurring, each with the state of its blocks: most of a matte is
/// plainly background or plainly foreground, and every stage works only where it is neither.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// Pixels of one block: one row high, this many columns; the last block of a row may be shorter.
inline constexpr int matte_block = 16;

/// What is known of a block. States are sets of possibilities: the state of two blocks together is
/// their bitwise or.
using BlockState = std::uint8_t;
inline constexpr BlockState block_full = 1;   ///< every value is the largest one
inline constexpr BlockState block_empty = 2;  ///< every value is 0
inline constexpr BlockState block_mixed = 3;

inline int blocks_across(int width) {
  return (width + matte_block - 1) / matte_block;
}

/// Eight states as one number.
inline std::uint64_t eight_states(const BlockState* from) {
  std::uint64_t eight;
  std::memcpy(&eight, from, 8);
  return eight;
}

/// A plane of 8-bit alpha, 255 foreground, 0 background. Rows are `stride` apart.
struct Matte {
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
  std::vector<std::uint8_t> values;
  std::vector<BlockState> states;  ///< blocks_across(width) per row, and room for eight_states()

  /// Sets the size, keeping the memory where it suffices; values and states are then undefined.
  void resize(int new_width, int new_height);
  std::uint8_t* row(int y) { return values.data() + stride * y; }
  const std::uint8_t* row(int y) const { return values.data() + stride * y; }
  BlockState* state_row(int y) {
    return states.data() + static_cast<std::size_t>(blocks_across(width)) * y;
  }
  const BlockState* state_row(int y) const {
    return states.data() + static_cast<std::size_t>(blocks_across(width)) * y;
  }
};

/// The values of a blurred matte: 128 per 8-bit level, so that the blur's precision reaches the
/// contour.
inline constexpr int field_scale = 128;
inline constexpr int field_full = 255 * field_scale;
inline constexpr int field_half = field_full / 2;

/// Room on both sides of a field's rows, holding the row's first and last value again.
inline constexpr int field_pad = 64;

/// A plane of blurred alpha, 0..field_full. Values of full and empty blocks are written too.
struct Field {
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  ///< in values, field_pad on both sides included
  std::vector<std::int16_t> values;
  std::vector<BlockState> states;

  /// Sets the size; a field of that size stays as it is, else all its blocks are mixed.
  void resize(int new_width, int new_height);
  std::int16_t* row(int y) { return values.data() + field_pad + stride * y; }
  const std::int16_t* row(int y) const { return values.data() + field_pad + stride * y; }
  BlockState* state_row(int y) {
    return states.data() + static_cast<std::size_t>(blocks_across(width)) * y;
  }
  const BlockState* state_row(int y) const {
    return states.data() + static_cast<std::size_t>(blocks_across(width)) * y;
  }
  /// Fills the room beside row \p y from its ends.
  void pad_row(int y);
};

/// Finds the states of one row of \p width alpha values.
void find_states(const std::uint8_t* row, int width, BlockState* states);

/// Reads a matte from every \p step-th byte (1: GRAY8, 4: the alpha of RGBA when \p first points at
/// the first pixel's alpha) of rows \p stride bytes apart.
void load_matte(const std::uint8_t* first, std::ptrdiff_t stride, int step, int width, int height,
                Matte& matte);

/// The field of an unblurred 8-bit matte: each value times field_scale.
void load_field(const Matte& matte, Field& field);

/// One row of a field rounded to 8 bit into every \p step-th byte from \p out on. With \p threshold
/// above 0: 255 where the rounded value is at least the threshold, else 0.
void store_field_row(const std::int16_t* row, int width, int threshold, std::uint8_t* out,
                     int step);

}  // namespace polyhull
