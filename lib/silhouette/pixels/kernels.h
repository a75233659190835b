// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of the silhouette stage, for several instruction sets. All variants give the
/// same bytes: most is integer arithmetic, and the floating point (kernels_float.inc) is of single
/// operations that are rounded alike everywhere.
#pragma once

#include <cstdint>

#include "silhouette/pixels/matte.h"

namespace polyhull::silhouette {

/// Key signals carry this many units per 8-bit level.
inline constexpr int signal_scale = 64;

/// Two weight vectors for the bytes of a four-byte pixel; signal = min of the two sums, saturated
/// to 16 bit. Each product pair (bytes 0+1, bytes 2+3) must fit 16 bit: |w0|+|w1| <= 128.
struct PixelForms {
  std::int8_t a[4];
  std::int8_t b[4];
  std::int16_t a_offset;  ///< added to the sums after they were saturated to 16 bit, saturating
  std::int16_t b_offset;
  bool operator==(const PixelForms&) const = default;
};

/// alpha = clamp(((base - signal) * gain + 2^14) >> 15, 0, 255), the difference saturated to 16
/// bit. A block all of whose values are at most `low` (at least `high`) becomes 0 (255) throughout:
/// noise is silenced where there is nothing else, and edges keep their exact ramp.
struct Ramp {
  std::int16_t base;
  std::int16_t gain;
  std::uint8_t low = 0;
  std::uint8_t high = 255;
  // Signals above `empty_above` have an alpha of `low` at most, signals below `full_below` one of `high`
  // at least; none where with_sure_signals() has not found them.
  std::int16_t empty_above = 32767, full_below = -32768;
  bool operator==(const Ramp&) const = default;
};
/// The ramp with what is plainly screen and plainly subject: the formula solved for the signal.
Ramp with_sure_signals(Ramp ramp);

/// What makes of alpha found in levels alpha found in light: with a in 0..1,
/// a + a (1 - a) (constant + slope a), the numbers 4096 for 1.
struct Bend {
  std::int32_t constant = 0, slope = 0;
  bool operator==(const Bend&) const = default;
};

/// Distance to a plate that may be darker or brighter: see KeyMethod::difference. alpha =
/// clamp((distance - low - tolerance) * slope).
struct DifferenceRamp {
  float darkest, brightest;
  float low;
  float slope;          ///< alpha per level
  float light_penalty;  ///< distance per level of light that a shadow took or a lamp added
};

/// See Kernels::find_changes; column 0 is bit 0 of the first word.
struct CellChanges {
  std::int32_t *on_row, *between, *cells;
  int on_row_count, between_count, cells_count;
};

struct Kernels {
  const char* name;

  /// Signals of `count` four-byte pixels.
  void (*pixel_signal)(const std::uint8_t* pixels, int count, const PixelForms& forms,
                       std::int16_t* signal);
  /// Alpha and states straight from four-byte pixels; count is a multiple of matte_block.
  void (*pixel_alpha)(const std::uint8_t* pixels, int count, const PixelForms& forms, Ramp ramp,
                      std::uint8_t* alpha, BlockState* states);
  /// Alpha and states from signals; count is a multiple of matte_block.
  void (*ramp_alpha)(const std::int16_t* signal, int count, Ramp ramp, std::uint8_t* alpha,
                     BlockState* states);
  /// The same with a base and a gain per pixel.
  void (*local_alpha)(const std::int16_t* signal, const std::int16_t* base,
                      const std::int16_t* gain, Ramp limits, int count, std::uint8_t* alpha,
                      BlockState* states);
  /// Signals of `count` chroma samples of two rows of interleaved (cb, cr): with
  /// c = near_weight * near + far_weight * far (weights sum to 4), the min over forms i = 0, 1 of
  /// (weights[2i] * cb + weights[2i+1] * cr + offsets[i]) >> 8, saturated to 16 bit.
  void (*chroma_signal)(const std::uint8_t* near_row, const std::uint8_t* far_row, int near_weight,
                        int far_weight, int count, const std::int16_t weights[4],
                        const std::int32_t offsets[2], std::int16_t* signal);
  /// Twice as many signals: even ones are the input's, odd ones the mean of their neighbours. Reads
  /// signal[count].
  void (*double_left)(const std::int16_t* signal, int count, std::int16_t* out);

  /// ramp_alpha() of what double_left() makes of signals, half as many as pixels.
  void (*doubled_alpha)(const std::int16_t* signal, int count, Ramp ramp, std::uint8_t* alpha,
                        BlockState* states);

  /// block_empty for blocks of pixels all of whose signals, half as many, and those beside are above
  /// a number, else block_mixed. Reads signal[-1] and signal[8 blocks].
  void (*screen_blocks)(const std::int16_t* signal, int blocks, std::int16_t above,
                        BlockState* states);

  /// Alpha of RGBA pixels against plate pixels (R, G, B, tolerance); count is a multiple of
  /// matte_block.
  void (*difference_alpha)(const std::uint8_t* pixels, const std::uint8_t* plate, int count,
                           const DifferenceRamp& ramp, std::uint8_t* alpha);

  /// Bends the alpha of mixed blocks, which stay mixed.
  void (*bend_blocks)(const Bend& bend, int blocks, std::uint8_t* alpha, const BlockState* states);

  /// Numbers of pixels between the centres of cells of 2 to 16 px: min(8 v, 32767) with
  /// v = left + ((right - left) (2 k + 1) >> (shift + 1)) at pixel k of the 1 << shift between the
  /// numbers of a cell and the next, for `count` cells; reads cells[count].
  void (*spread_cells)(const std::int16_t* cells, int count, int shift, std::int16_t* out);

  /// States of whole blocks of alpha.
  void (*states)(const std::uint8_t* alpha, int blocks, BlockState* states);

  /// The mixed ones of a row of blocks, ascending; returns how many. Writes one entry more.
  int (*mixed_blocks)(const BlockState* states, int blocks, std::uint16_t* list);

  /// out[x] = (sum over k of weights[k] * (rows[r-k][x] + rows[r+k][x]) + 2^8) >> 9 for the columns
  /// of `count` blocks, the centre row once. weights has radius+1 entries and one 0 after them;
  /// weights[0] + 2 * the rest is 2^15. radius is at most 400.
  void (*fir_vertical)(const std::uint8_t* const* rows, int radius, const std::int16_t* weights,
                       const std::uint16_t* blocks, int count, std::int16_t* out);
  /// The same along a row, values 64 per level in, 128 per level out: shifted by 14.
  void (*fir_horizontal)(const std::int16_t* in, int radius, const std::int16_t* weights,
                         const std::uint16_t* blocks, int count, std::int16_t* out);

  /// The columns' corrected values for each listed block: with d = value - field_half,
  /// corrected[x] = centre * d(x) - side * (d(x-reach) + d(x+reach) + up + down); bits[block]:
  /// which are not negative, the first in bit 0.
  void (*inside)(const std::int16_t* up, const std::int16_t* row, const std::int16_t* down,
                 int reach, std::int16_t centre, std::int16_t side, const std::uint16_t* blocks,
                 int count, std::int32_t* corrected, std::uint16_t* bits);

  /// What changes between two rows of inside bits, `words` words (a multiple of 4) and one more
  /// that is 0: the columns of changes to the right on the row below, those of changes between the
  /// rows, and the cells with any, as 16 * column + their four corners (see trace_cells.cpp), each
  /// ascending. Writes one entry more.
  void (*find_changes)(const std::uint64_t* above, const std::uint64_t* below, int words,
                       CellChanges& changes);
  /// Where the level is crossed between values a >= 0 > b or a < 0 <= b one px apart: in (0, 1), a
  /// multiple of 1/512. The half unit keeps it off the pixel centre when a value is 0. Reads and
  /// writes up to seven entries more.
  void (*crossing_offsets)(const std::int32_t* a, const std::int32_t* b, int count, float* offsets);

  /// max |nx x + ny y - c| of `count` points, px.
  float (*line_deviation)(const float* x, const float* y, int count, float nx, float ny, float c);
  /// The largest squared distance from the segment that starts at (ax, ay) and has the unit
  /// direction (ux, uy) and the length `length`.
  float (*edge_deviation)(const float* x, const float* y, int count, float ax, float ay, float ux,
                          float uy, float length);
};

const Kernels& plain_kernels();
#if defined(__x86_64__)
const Kernels& baseline_kernels();
const Kernels& avx2_kernels();    ///< only where has_avx2(), base/instruction_set.h
const Kernels& avx512_kernels();  ///< only where has_avx512()
#endif

/// The best for this machine; POLYHULL_ISA=plain|baseline|avx2|avx512 in the environment overrides
/// (read once; what cannot be had is said on standard error, see choose_kernels.h).
const Kernels& kernels();

}  // namespace polyhull::silhouette
