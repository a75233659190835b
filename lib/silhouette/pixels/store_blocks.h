// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How the key writes alphas with their blocks' states, for the kernels with AVX2 and more.
/// Internal.
#pragma once

#include <immintrin.h>

#include "silhouette/pixels/kernels.h"

namespace polyhull::silhouette {
namespace {  // compiled for each instruction set: no variant may stand in for another

/// Writes 32 alphas and the states of their two blocks of 16. Bit i of \p empty (\p full): alpha i
/// counts as 0 (255); a block of nothing else becomes that.
inline void store_two_blocks(__m256i alphas, std::uint32_t empty, std::uint32_t full,
                             std::uint8_t* alpha, BlockState* states) {
  const auto store = [&](__m128i values, std::uint32_t is_empty, std::uint32_t is_full, int i) {
    states[i] = is_empty == 0xffff ? block_empty : is_full == 0xffff ? block_full : block_mixed;
    values = states[i] == block_empty  ? _mm_setzero_si128()
             : states[i] == block_full ? _mm_set1_epi8(-1)
                                       : values;
    _mm_storeu_si128(reinterpret_cast<__m128i*>(alpha + 16 * i), values);
  };
  store(_mm256_castsi256_si128(alphas), empty & 0xffff, full & 0xffff, 0);
  store(_mm256_extracti128_si256(alphas, 1), empty >> 16, full >> 16, 1);
}

}  // namespace
}  // namespace polyhull::silhouette
