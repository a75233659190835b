// SPDX-License-Identifier: LGPL-2.1-or-later
// The kernels for every x86-64 machine (SSE2).
#include <emmintrin.h>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {
namespace {

using Vec = __m128i;
constexpr int lanes = 8;

inline Vec load(const std::int16_t* p) {
  return _mm_loadu_si128(reinterpret_cast<const Vec*>(p));
}
inline void store(std::int16_t* p, Vec v) {
  _mm_storeu_si128(reinterpret_cast<Vec*>(p), v);
}
inline Vec widen(const std::uint8_t* p) {
  return _mm_unpacklo_epi8(_mm_loadl_epi64(reinterpret_cast<const Vec*>(p)), _mm_setzero_si128());
}
inline Vec set16(std::int16_t v) {
  return _mm_set1_epi16(v);
}
inline Vec set32(std::int32_t v) {
  return _mm_set1_epi32(v);
}
inline Vec add16(Vec a, Vec b) {
  return _mm_add_epi16(a, b);
}
inline Vec sub16(Vec a, Vec b) {
  return _mm_sub_epi16(a, b);
}
inline Vec mul16(Vec a, Vec b) {
  return _mm_mullo_epi16(a, b);
}
inline Vec min16(Vec a, Vec b) {
  return _mm_min_epi16(a, b);
}
inline Vec add32(Vec a, Vec b) {
  return _mm_add_epi32(a, b);
}
inline Vec madd(Vec a, Vec b) {
  return _mm_madd_epi16(a, b);
}
inline Vec unpack_lo(Vec a, Vec b) {
  return _mm_unpacklo_epi16(a, b);
}
inline Vec unpack_hi(Vec a, Vec b) {
  return _mm_unpackhi_epi16(a, b);
}
template <int n>
inline Vec shift_right32(Vec a) {
  return _mm_srai_epi32(a, n);
}
inline Vec pack32(Vec a, Vec b) {
  return _mm_packs_epi32(a, b);
}
inline Vec in_order(Vec a) {
  return a;
}
// 32-bit numbers for the lanes of a vector, as unpacking its halves orders them; pack32() and
// store_wide() restore the order.
struct Wide {
  Vec lo, hi;
};
inline void store_wide(std::int32_t* p, const Wide& wide) {
  _mm_storeu_si128(reinterpret_cast<Vec*>(p), wide.lo);
  _mm_storeu_si128(reinterpret_cast<Vec*>(p + 4), wide.hi);
}
inline std::uint32_t sign_bits(Vec a) {
  return static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(a, a))) & 0xffu;
}

// (a * b + 2^14) >> 15, SSSE3's instruction spelled out.
inline __m128i mulhrs(__m128i a, __m128i b) {
  const __m128i low = _mm_mullo_epi16(a, b), high = _mm_mulhi_epi16(a, b);
  const __m128i rounding = _mm_set1_epi32(0x4000);
  return _mm_packs_epi32(
      _mm_srai_epi32(_mm_add_epi32(_mm_unpacklo_epi16(low, high), rounding), 15),
      _mm_srai_epi32(_mm_add_epi32(_mm_unpackhi_epi16(low, high), rounding), 15));
}

}  // namespace
}  // namespace polyhull::silhouette

#include "silhouette/pixels/kernels_float.inc"
#include "silhouette/pixels/kernels_simd.inc"

namespace polyhull::silhouette {
namespace {

// One form's value of four pixels, 32 bit each.
inline __m128i four_sums(__m128i pixels, __m128i weights) {
  const __m128i zero = _mm_setzero_si128();
  const __m128 a = _mm_castsi128_ps(_mm_madd_epi16(_mm_unpacklo_epi8(pixels, zero), weights));
  const __m128 b = _mm_castsi128_ps(_mm_madd_epi16(_mm_unpackhi_epi8(pixels, zero), weights));
  return _mm_add_epi32(_mm_castps_si128(_mm_shuffle_ps(a, b, 0x88)),
                       _mm_castps_si128(_mm_shuffle_ps(a, b, 0xdd)));
}

inline __m128i weights_of(const std::int8_t w[4]) {
  return _mm_setr_epi16(w[0], w[1], w[2], w[3], w[0], w[1], w[2], w[3]);
}

// Signals of eight pixels.
inline __m128i eight_signals(const std::uint8_t* pixels, __m128i a, __m128i b, __m128i a_offset,
                             __m128i b_offset) {
  const __m128i p = load128(pixels), q = load128(pixels + 16);
  return _mm_min_epi16(_mm_adds_epi16(_mm_packs_epi32(four_sums(p, a), four_sums(q, a)), a_offset),
                       _mm_adds_epi16(_mm_packs_epi32(four_sums(p, b), four_sums(q, b)), b_offset));
}

void pixel_signal(const std::uint8_t* pixels, int count, const PixelForms& forms,
                  std::int16_t* signal) {
  const __m128i a = weights_of(forms.a), b = weights_of(forms.b);
  const __m128i oa = _mm_set1_epi16(forms.a_offset), ob = _mm_set1_epi16(forms.b_offset);
  int x = 0;
  for (; x + 8 <= count; x += 8) store(signal + x, eight_signals(pixels + 4 * x, a, b, oa, ob));
  if (x < count) plain_kernels().pixel_signal(pixels + 4 * x, count - x, forms, signal + x);
}

void pixel_alpha(const std::uint8_t* pixels, int count, const PixelForms& forms, Ramp ramp,
                 std::uint8_t* alpha, BlockState* block_states) {
  const __m128i a = weights_of(forms.a), b = weights_of(forms.b);
  const __m128i oa = _mm_set1_epi16(forms.a_offset), ob = _mm_set1_epi16(forms.b_offset);
  const __m128i base = _mm_set1_epi16(ramp.base), gain = _mm_set1_epi16(ramp.gain);
  const Limits limits(ramp);
  for (int x = 0; x < count; x += 16)
    store_alpha(
        mulhrs(_mm_subs_epi16(base, eight_signals(pixels + 4 * x, a, b, oa, ob)), gain),
        mulhrs(_mm_subs_epi16(base, eight_signals(pixels + 4 * x + 32, a, b, oa, ob)), gain),
        limits, alpha + x, block_states + x / 16);
}

}  // namespace

const Kernels& baseline_kernels() {
  static const Kernels table{
      "baseline",       pixel_signal,   pixel_alpha,   ramp_alpha,       local_alpha, chroma_signal,
      double_left,      doubled_alpha,  screen_blocks, difference_alpha, bend_blocks, spread_cells,
      states,           mixed_blocks,   fir_vertical,  fir_horizontal,   inside,      find_changes,
      crossing_offsets, line_deviation, edge_deviation};
  return table;
}

}  // namespace polyhull::silhouette
