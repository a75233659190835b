// SPDX-License-Identifier: LGPL-2.1-or-later
// The kernels as plain loops: what the other variants are tested against, and what machines without
// a variant of their own run.
#include <algorithm>

#include "silhouette/pixels/kernels.h"

#include "silhouette/pixels/kernels_float.inc"

namespace polyhull::silhouette {
namespace {

std::int32_t saturate16(std::int32_t v) {
  return std::clamp(v, -32768, 32767);
}

std::int16_t signal_of(const std::uint8_t* p, const PixelForms& forms) {
  std::int32_t a = 0, b = 0;
  for (int i = 0; i < 4; ++i) {
    a += p[i] * forms.a[i];
    b += p[i] * forms.b[i];
  }
  return static_cast<std::int16_t>(std::min(saturate16(saturate16(a) + forms.a_offset),
                                            saturate16(saturate16(b) + forms.b_offset)));
}

std::uint8_t alpha_of(std::int32_t signal, std::int32_t base, std::int32_t gain) {
  return static_cast<std::uint8_t>(
      std::clamp((saturate16(base - signal) * gain + 0x4000) >> 15, 0, 255));
}

void states(const std::uint8_t* alpha, int blocks, BlockState* states) {
  for (int b = 0; b < blocks; ++b, alpha += matte_block) {
    bool empty = true, full = true;
    for (int x = 0; x < matte_block; ++x) {
      empty &= alpha[x] == 0;
      full &= alpha[x] == 255;
    }
    states[b] = empty ? block_empty : full ? block_full : block_mixed;
  }
}

// The states of alpha values, silenced where a block is nothing but noise.
void silence(std::uint8_t* alpha, int count, Ramp ramp, BlockState* block_states) {
  for (int x = 0; x < count; x += matte_block) {
    const auto [low, high] = std::minmax_element(alpha + x, alpha + x + matte_block);
    if (*high <= ramp.low)
      std::fill_n(alpha + x, matte_block, std::uint8_t{0});
    else if (*low >= ramp.high)
      std::fill_n(alpha + x, matte_block, std::uint8_t{255});
  }
  states(alpha, count / matte_block, block_states);
}

void pixel_signal(const std::uint8_t* pixels, int count, const PixelForms& forms,
                  std::int16_t* signal) {
  for (int x = 0; x < count; ++x) signal[x] = signal_of(pixels + 4 * x, forms);
}

void pixel_alpha(const std::uint8_t* pixels, int count, const PixelForms& forms, Ramp ramp,
                 std::uint8_t* alpha, BlockState* block_states) {
  for (int x = 0; x < count; ++x)
    alpha[x] = alpha_of(signal_of(pixels + 4 * x, forms), ramp.base, ramp.gain);
  silence(alpha, count, ramp, block_states);
}

void ramp_alpha(const std::int16_t* signal, int count, Ramp ramp, std::uint8_t* alpha,
                BlockState* block_states) {
  for (int x = 0; x < count; ++x) alpha[x] = alpha_of(signal[x], ramp.base, ramp.gain);
  silence(alpha, count, ramp, block_states);
}

void local_alpha(const std::int16_t* signal, const std::int16_t* base, const std::int16_t* gain,
                 Ramp limits, int count, std::uint8_t* alpha, BlockState* block_states) {
  for (int x = 0; x < count; ++x) alpha[x] = alpha_of(signal[x], base[x], gain[x]);
  silence(alpha, count, limits, block_states);
}

void chroma_signal(const std::uint8_t* near_row, const std::uint8_t* far_row, int near_weight,
                   int far_weight, int count, const std::int16_t weights[4],
                   const std::int32_t offsets[2], std::int16_t* signal) {
  for (int x = 0; x < count; ++x) {
    const std::int32_t cb = near_weight * near_row[2 * x] + far_weight * far_row[2 * x];
    const std::int32_t cr = near_weight * near_row[2 * x + 1] + far_weight * far_row[2 * x + 1];
    const std::int32_t a = (weights[0] * cb + weights[1] * cr + offsets[0]) >> 8;
    const std::int32_t b = (weights[2] * cb + weights[3] * cr + offsets[1]) >> 8;
    signal[x] = static_cast<std::int16_t>(saturate16(std::min(a, b)));
  }
}

void double_left(const std::int16_t* signal, int count, std::int16_t* out) {
  for (int x = 0; x < count; ++x) {
    out[2 * x] = signal[x];
    out[2 * x + 1] = static_cast<std::int16_t>((signal[x] + signal[x + 1] + 1) >> 1);
  }
}

void doubled_alpha(const std::int16_t* signal, int count, Ramp ramp, std::uint8_t* alpha,
                   BlockState* block_states) {
  for (int x = 0; x < count; x += matte_block) {
    std::int16_t doubled[matte_block];
    double_left(signal + x / 2, matte_block / 2, doubled);
    ramp_alpha(doubled, matte_block, ramp, alpha + x, block_states + x / matte_block);
  }
}

void screen_blocks(const std::int16_t* signal, int blocks, std::int16_t above, BlockState* states) {
  for (int b = 0; b < blocks; ++b, signal += matte_block / 2)
    states[b] = *std::min_element(signal - 1, signal + matte_block / 2 + 1) > above ? block_empty
                                                                                    : block_mixed;
}

int mixed_blocks(const BlockState* states, int blocks, std::uint16_t* list) {
  int count = 0;
  for (int b = 0; b < blocks; ++b)
    if (states[b] == block_mixed) list[count++] = static_cast<std::uint16_t>(b);
  return count;
}

void fir_vertical(const std::uint8_t* const* rows, int radius, const std::int16_t* weights,
                  const std::uint16_t* blocks, int count, std::int16_t* out) {
  for (int i = 0; i < count * matte_block; ++i) {
    const int x = blocks[i / matte_block] * matte_block + i % matte_block;
    std::int32_t sum = weights[0] * rows[radius][x];
    for (int k = 1; k <= radius; ++k)
      sum += weights[k] * (rows[radius - k][x] + rows[radius + k][x]);
    out[x] = static_cast<std::int16_t>((sum + (1 << 8)) >> 9);
  }
}

void fir_horizontal(const std::int16_t* in, int radius, const std::int16_t* weights,
                    const std::uint16_t* blocks, int count, std::int16_t* out) {
  for (int i = 0; i < count * matte_block; ++i) {
    const int x = blocks[i / matte_block] * matte_block + i % matte_block;
    std::int32_t sum = weights[0] * in[x];
    for (int k = 1; k <= radius; ++k) sum += weights[k] * (in[x - k] + in[x + k]);
    out[x] = static_cast<std::int16_t>((sum + (1 << 13)) >> 14);
  }
}

void inside(const std::int16_t* up, const std::int16_t* row, const std::int16_t* down, int reach,
            std::int16_t centre, std::int16_t side, const std::uint16_t* blocks, int count,
            std::int32_t* corrected, std::uint16_t* bits) {
  for (int b = 0; b < count; ++b) {
    const int x = blocks[b] * matte_block;
    std::uint32_t word = 0;
    for (int i = x; i < x + 16; ++i) {
      const std::int32_t around =
          row[i - reach] + row[i + reach] + up[i] + down[i] - 4 * field_half;
      const std::int32_t value = centre * (row[i] - field_half) - side * around;
      corrected[i] = value;
      word |= static_cast<std::uint32_t>(value >= 0) << (i - x);
    }
    bits[blocks[b]] = static_cast<std::uint16_t>(word);
  }
}

}  // namespace

const Kernels& plain_kernels() {
  static const Kernels table{
      "plain",          pixel_signal,   pixel_alpha,   ramp_alpha,       local_alpha, chroma_signal,
      double_left,      doubled_alpha,  screen_blocks, difference_alpha, bend_blocks, spread_cells,
      states,           mixed_blocks,   fir_vertical,  fir_horizontal,   inside,      find_changes,
      crossing_offsets, line_deviation, edge_deviation};
  return table;
}

}  // namespace polyhull::silhouette
