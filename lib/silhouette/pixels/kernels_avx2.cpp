// SPDX-License-Identifier: LGPL-2.1-or-later
// The kernels for x86-64-v3 (AVX2).
#include <immintrin.h>

#include "silhouette/pixels/kernels.h"
#include "silhouette/pixels/store_blocks.h"

namespace polyhull::silhouette {
namespace {

using Vec = __m256i;
constexpr int lanes = 16;

inline Vec load(const std::int16_t* p) {
  return _mm256_loadu_si256(reinterpret_cast<const Vec*>(p));
}
inline void store(std::int16_t* p, Vec v) {
  _mm256_storeu_si256(reinterpret_cast<Vec*>(p), v);
}
inline Vec widen(const std::uint8_t* p) {
  return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
inline Vec set16(std::int16_t v) {
  return _mm256_set1_epi16(v);
}
inline Vec set32(std::int32_t v) {
  return _mm256_set1_epi32(v);
}
inline Vec add16(Vec a, Vec b) {
  return _mm256_add_epi16(a, b);
}
inline Vec sub16(Vec a, Vec b) {
  return _mm256_sub_epi16(a, b);
}
inline Vec mul16(Vec a, Vec b) {
  return _mm256_mullo_epi16(a, b);
}
inline Vec min16(Vec a, Vec b) {
  return _mm256_min_epi16(a, b);
}
inline Vec add32(Vec a, Vec b) {
  return _mm256_add_epi32(a, b);
}
inline Vec madd(Vec a, Vec b) {
  return _mm256_madd_epi16(a, b);
}
inline Vec unpack_lo(Vec a, Vec b) {
  return _mm256_unpacklo_epi16(a, b);
}
inline Vec unpack_hi(Vec a, Vec b) {
  return _mm256_unpackhi_epi16(a, b);
}
template <int n>
inline Vec shift_right32(Vec a) {
  return _mm256_srai_epi32(a, n);
}
inline Vec pack32(Vec a, Vec b) {
  return _mm256_packs_epi32(a, b);
}
// After packing two vectors that each were in order (not halves of an unpack).
inline Vec in_order(Vec a) {
  return _mm256_permute4x64_epi64(a, 0xd8);
}
// 32-bit numbers for the lanes of a vector, as unpacking its halves orders them; pack32() and
// store_wide() restore the order.
struct Wide {
  Vec lo, hi;
};
inline void store_wide(std::int32_t* p, const Wide& wide) {
  const auto quarter = [](std::int32_t* to, __m128i v) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), v);
  };
  quarter(p, _mm256_castsi256_si128(wide.lo));
  quarter(p + 4, _mm256_castsi256_si128(wide.hi));
  quarter(p + 8, _mm256_extracti128_si256(wide.lo, 1));
  quarter(p + 12, _mm256_extracti128_si256(wide.hi, 1));
}
inline std::uint32_t sign_bits(Vec a) {
  const Vec bytes = _mm256_permute4x64_epi64(_mm256_packs_epi16(a, a), 0xd8);
  return static_cast<std::uint32_t>(_mm_movemask_epi8(_mm256_castsi256_si128(bytes)));
}
inline __m128i mulhrs(__m128i a, __m128i b) {
  return _mm_mulhrs_epi16(a, b);
}

}  // namespace
}  // namespace polyhull::silhouette

#include "silhouette/pixels/kernels_float.inc"
#include "silhouette/pixels/kernels_simd.inc"

namespace polyhull::silhouette {
namespace {

inline Vec weights_of(const std::int8_t w[4]) {
  return _mm256_set1_epi32(
      static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::uint8_t>(w[0])) |
                                static_cast<std::uint32_t>(static_cast<std::uint8_t>(w[1])) << 8 |
                                static_cast<std::uint32_t>(static_cast<std::uint8_t>(w[2])) << 16 |
                                static_cast<std::uint32_t>(static_cast<std::uint8_t>(w[3])) << 24));
}

inline Vec sums(Vec pixels, Vec weights) {
  return _mm256_madd_epi16(_mm256_maddubs_epi16(pixels, weights), _mm256_set1_epi16(1));
}

// Signals of 16 pixels, their quarters in the order 0 2 1 3.
inline Vec sixteen_signals(const std::uint8_t* pixels, Vec a, Vec b, Vec a_offset, Vec b_offset) {
  const Vec p = _mm256_loadu_si256(reinterpret_cast<const Vec*>(pixels));
  const Vec q = _mm256_loadu_si256(reinterpret_cast<const Vec*>(pixels + 32));
  return _mm256_min_epi16(_mm256_adds_epi16(pack32(sums(p, a), sums(q, a)), a_offset),
                          _mm256_adds_epi16(pack32(sums(p, b), sums(q, b)), b_offset));
}

void pixel_signal(const std::uint8_t* pixels, int count, const PixelForms& forms,
                  std::int16_t* signal) {
  const Vec a = weights_of(forms.a), b = weights_of(forms.b);
  const Vec oa = set16(forms.a_offset), ob = set16(forms.b_offset);
  int x = 0;
  for (; x + 16 <= count; x += 16)
    store(signal + x, in_order(sixteen_signals(pixels + 4 * x, a, b, oa, ob)));
  if (x < count) plain_kernels().pixel_signal(pixels + 4 * x, count - x, forms, signal + x);
}

void pixel_alpha(const std::uint8_t* pixels, int count, const PixelForms& forms, Ramp ramp,
                 std::uint8_t* alpha, BlockState* block_states) {
  const Vec a = weights_of(forms.a), b = weights_of(forms.b);
  const Vec oa = set16(forms.a_offset), ob = set16(forms.b_offset);
  const Vec base = set16(ramp.base), gain = set16(ramp.gain);
  const Vec zero = _mm256_setzero_si256(), ones = _mm256_set1_epi8(-1);
  const Vec lowest = _mm256_set1_epi8(static_cast<char>(ramp.low));
  const Vec highest = _mm256_set1_epi8(static_cast<char>(ramp.high));
  const Vec order = _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7);
  const Vec surely_empty = set16(ramp.empty_above), surely_full = set16(ramp.full_below);
  const auto everywhere = [](Vec mask) { return _mm256_movemask_epi8(mask) == -1; };
  std::ptrdiff_t x = 0;
  for (; x + 32 <= count; x += 32) {
    const Vec first = sixteen_signals(pixels + 4 * x, a, b, oa, ob);
    const Vec second = sixteen_signals(pixels + 4 * x + 64, a, b, oa, ob);
    BlockState* state = block_states + x / 16;
    // Most of a picture is one or the other for long, which its signals tell without their alpha.
    if (everywhere(_mm256_cmpgt_epi16(min16(first, second), surely_empty))) {
      _mm256_storeu_si256(reinterpret_cast<Vec*>(alpha + x), zero);
      state[0] = state[1] = block_empty;
      continue;
    }
    if (everywhere(_mm256_cmpgt_epi16(surely_full, _mm256_max_epi16(first, second)))) {
      _mm256_storeu_si256(reinterpret_cast<Vec*>(alpha + x), ones);
      state[0] = state[1] = block_full;
      continue;
    }
    const Vec low = _mm256_mulhrs_epi16(_mm256_subs_epi16(base, first), gain);
    const Vec high = _mm256_mulhrs_epi16(_mm256_subs_epi16(base, second), gain);
    const Vec v = _mm256_permutevar8x32_epi32(_mm256_packus_epi16(low, high), order);
    const auto empty = static_cast<std::uint32_t>(
        _mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_subs_epu8(v, lowest), zero)));
    const auto full = static_cast<std::uint32_t>(
        _mm256_movemask_epi8(_mm256_cmpeq_epi8(_mm256_subs_epu8(highest, v), zero)));
    store_two_blocks(v, empty, full, alpha + x, state);
  }
  if (x < count) {
    const Vec v = in_order(_mm256_mulhrs_epi16(
        _mm256_subs_epi16(base, sixteen_signals(pixels + 4 * x, a, b, oa, ob)), gain));
    store_alpha(_mm256_castsi256_si128(v), _mm256_extracti128_si256(v, 1), Limits(ramp), alpha + x,
                block_states + x / 16);
  }
}

// Two blocks at a time while both are empty or both full: what lies between two samples lies
// between theirs.
void doubled_alpha_pairs(const std::int16_t* signal, int count, Ramp ramp, std::uint8_t* alpha,
                         BlockState* block_states) {
  const Vec zero = _mm256_setzero_si256(), ones = _mm256_set1_epi8(-1);
  const Vec surely_empty = set16(ramp.empty_above), surely_full = set16(ramp.full_below);
  const auto everywhere = [](Vec mask) { return _mm256_movemask_epi8(mask) == -1; };
  std::ptrdiff_t x = 0;
  for (; x + 32 <= count; x += 32) {
    const std::int16_t* from = signal + (x >> 1);
    const Vec first = load(from), second = load(from + 1);
    if (everywhere(_mm256_cmpgt_epi16(min16(first, second), surely_empty))) {
      _mm256_storeu_si256(reinterpret_cast<Vec*>(alpha + x), zero);
      block_states[x >> 4] = block_states[(x >> 4) + 1] = block_empty;
    } else if (everywhere(_mm256_cmpgt_epi16(surely_full, _mm256_max_epi16(first, second)))) {
      _mm256_storeu_si256(reinterpret_cast<Vec*>(alpha + x), ones);
      block_states[x >> 4] = block_states[(x >> 4) + 1] = block_full;
    } else {
      doubled_alpha(from, 32, ramp, alpha + x, block_states + (x >> 4));
    }
  }
  doubled_alpha(signal + (x >> 1), static_cast<int>(count - x), ramp, alpha + x,
                block_states + (x >> 4));
}

}  // namespace

const Kernels& avx2_kernels() {
  static const Kernels table{"avx2",        pixel_signal,     pixel_alpha,      ramp_alpha,
                             local_alpha,   chroma_signal,    double_left,      doubled_alpha_pairs,
                             screen_blocks, difference_alpha, bend_blocks,      spread_cells,
                             states,        mixed_blocks,     fir_vertical,     fir_horizontal,
                             inside,        find_changes,     crossing_offsets, line_deviation,
                             edge_deviation};
  return table;
}

}  // namespace polyhull::silhouette
