// SPDX-License-Identifier: LGPL-2.1-or-later
// The key for x86-64-v4 with the instructions for dot products (AVX-512 BW and VNNI); all else is
// as for AVX2.
#include <immintrin.h>

#include <cstring>

#include "silhouette/pixels/kernels.h"
#include "silhouette/pixels/store_blocks.h"

namespace polyhull::silhouette {
namespace {

void pixel_alpha(const std::uint8_t* pixels, int count, const PixelForms& forms, Ramp ramp,
                 std::uint8_t* alpha, BlockState* block_states) {
  const auto weights = [](const std::int8_t w[4]) {
    std::int32_t four;
    std::memcpy(&four, w, sizeof four);
    return _mm512_set1_epi32(four);
  };
  const __m512i a = weights(forms.a), b = weights(forms.b);
  const __m512i a_offset = _mm512_set1_epi16(forms.a_offset);
  const __m512i b_offset = _mm512_set1_epi16(forms.b_offset);
  const __m512i base = _mm512_set1_epi16(ramp.base), gain = _mm512_set1_epi16(ramp.gain);
  const __m256i zero = _mm256_setzero_si256(), ones = _mm256_set1_epi8(-1);
  const __m256i lowest = _mm256_set1_epi8(static_cast<char>(ramp.low));
  const __m256i highest = _mm256_set1_epi8(static_cast<char>(ramp.high));
  const __m512i surely_empty = _mm512_set1_epi16(ramp.empty_above);
  const __m512i surely_full = _mm512_set1_epi16(ramp.full_below);
  // Packing takes four numbers from one vector and then four from the other.
  const __m256i order = _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7);
  std::ptrdiff_t x = 0;
  for (; x + 32 <= count; x += 32) {
    const __m512i p = _mm512_loadu_si512(pixels + 4 * x);
    const __m512i q = _mm512_loadu_si512(pixels + 4 * x + 64);
    const auto form = [&](__m512i w, __m512i offset) {
      const __m512i nothing = _mm512_setzero_si512();
      return _mm512_adds_epi16(_mm512_packs_epi32(_mm512_dpbusd_epi32(nothing, p, w),
                                                  _mm512_dpbusd_epi32(nothing, q, w)),
                               offset);
    };
    const __m512i signals = _mm512_min_epi16(form(a, a_offset), form(b, b_offset));
    BlockState* state = block_states + x / 16;
    if (_mm512_cmpgt_epi16_mask(signals, surely_empty) == 0xffffffffu) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(alpha + x), zero);
      state[0] = state[1] = block_empty;
      continue;
    }
    if (_mm512_cmpgt_epi16_mask(surely_full, signals) == 0xffffffffu) {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(alpha + x), ones);
      state[0] = state[1] = block_full;
      continue;
    }
    const __m512i exact = _mm512_mulhrs_epi16(_mm512_subs_epi16(base, signals), gain);
    const __m512i positive = _mm512_max_epi16(exact, _mm512_setzero_si512());
    const __m256i v =
        _mm256_permutevar8x32_epi32(_mm512_maskz_cvtusepi16_epi8(0xffffffffu, positive), order);
    const std::uint32_t empty = _mm256_cmple_epu8_mask(v, lowest);
    const std::uint32_t full = _mm256_cmpge_epu8_mask(v, highest);
    store_two_blocks(v, empty, full, alpha + x, state);
  }
  if (x < count)
    avx2_kernels().pixel_alpha(pixels + 4 * x, static_cast<int>(count - x), forms, ramp, alpha + x,
                               block_states + x / 16);
}

}  // namespace

const Kernels& avx512_kernels() {
  static const Kernels table = [] {
    Kernels kernels = avx2_kernels();
    kernels.name = "avx512";
    kernels.pixel_alpha = pixel_alpha;
    return kernels;
  }();
  return table;
}

}  // namespace polyhull::silhouette
