// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The sample points of a pixel in CoverageRaster, and which of them a triangle covers. Internal to
/// its files, and a header so that the loops are inlined there.
///
/// Sample (i, j), 0 <= i, j < 8, lies at (128 i + 16 j - 504, 128 j + 16 i - 504) / 1024 px from
/// the pixel's centre: a square lattice sheared both ways. It is bit 8 i + j of a mask. Two samples
/// of each row decide on depth: columns depth_column[j] and that plus 4.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#else
#include <algorithm>
#endif

namespace polyhull::coverage {

inline constexpr std::int32_t unit = 1024;  ///< per pixel
inline constexpr std::uint32_t nothing = ~std::uint32_t{0};

/// The pixel that a coordinate in 1/1024 px lies in.
inline std::int32_t floor_pixel(std::int32_t fixed) {
  return (fixed + unit / 2) >> 10;
}

/// The first pixel whose centre is not before a coordinate, and the last whose is not behind it.
inline std::int32_t next_centre(std::int32_t fixed) {
  return (fixed + unit - 1) >> 10;
}
inline std::int32_t last_centre(std::int32_t fixed) {
  return fixed >> 10;
}

inline constexpr int samples = 64;
inline constexpr int depth_samples = 16;
inline constexpr int depth_column[8] = {0, 2, 1, 3, 0, 2, 1, 3};

struct DepthPattern {
  alignas(16) std::array<float, depth_samples> x, y;  // 1/1024 px
};

constexpr DepthPattern make_depth_pattern() {
  DepthPattern pattern{};
  for (int k = 0; k < depth_samples; ++k) {
    const int j = k / 2, i = depth_column[j] + 4 * (k % 2);
    pattern.x[k] = static_cast<float>(128 * i + 16 * j - 504);
    pattern.y[k] = static_cast<float>(128 * j + 16 * i - 504);
  }
  return pattern;
}
inline constexpr DepthPattern pattern = make_depth_pattern();

/// The bits of a byte, one zero between any two.
inline std::uint32_t spread_bits(std::uint32_t bits) {
  bits = (bits | bits << 4) & 0x0f0f;
  bits = (bits | bits << 2) & 0x3333;
  return (bits | bits << 1) & 0x5555;
}

/// The bits of the depth samples of \p mask: bit k for sample k of the depth pattern.
inline std::uint32_t depth_bits(std::uint64_t mask) {
  // Of rows 0 and 4 column 0, of rows 1 and 5 column 2, and so on, as depth_column says.
  const auto rows = [](std::uint32_t columns) {
    return (columns & 0x11) | (columns >> 16 & 0x22) | (columns >> 8 & 0x44) |
           (columns >> 24 & 0x88);
  };
  return spread_bits(rows(static_cast<std::uint32_t>(mask))) |
         spread_bits(rows(static_cast<std::uint32_t>(mask >> 32))) << 1;
}

/// What an edge function a x + b y gains from one sample to the next, and its extremes in a pixel.
struct EdgeSteps {
  std::int32_t column, row, first, reach;
};

inline EdgeSteps edge_steps(std::int32_t a, std::int32_t b) {
  return {128 * a + 16 * b, 16 * a + 128 * b, -504 * (a + b),
          (std::abs(a) + std::abs(b)) * (unit / 2)};
}

/// Bit 8 i + j: sample (i, j) lies on the inner side of all three edges, whose functions are \p e
/// at the pixel's centre.
[[gnu::always_inline]] inline std::uint64_t inside(const std::int32_t (&e)[3],
                                                   const EdgeSteps (&steps)[3]) {
  using Int8 = int __attribute__((vector_size(32)));
  using Char8 = unsigned char __attribute__((vector_size(8)));
  const Int8 columns = {0, 1, 2, 3, 4, 5, 6, 7};
  Int8 a = columns * steps[0].column + (e[0] + steps[0].first);
  Int8 b = columns * steps[1].column + (e[1] + steps[1].first);
  Int8 c = columns * steps[2].column + (e[2] + steps[2].first);
  Int8 outside = {};
  for (int j = 0; j < 8; ++j) {
    // A negative value is outside.
    outside |= ((a | b | c) >> 31) & (1 << j);
    a += steps[0].row;
    b += steps[1].row;
    c += steps[2].row;
  }
  const Char8 bytes = __builtin_convertvector(outside, Char8);
  std::uint64_t mask;
  std::memcpy(&mask, &bytes, sizeof mask);
  return ~mask;
}

/// Where \p bits has a depth sample and the plane centre + gx x + gy y (held between \p far and
/// \p near) is nearer than what is there, writes it and \p index.
inline void test_depth(std::uint32_t bits, float centre, float gx, float gy, float far, float near,
                       std::uint32_t index, float* depth, std::uint32_t* triangle) {
#ifdef __SSE2__
  const __m128i lanes = _mm_set_epi32(8, 4, 2, 1);
  for (int k = 0; k < depth_samples; k += 4, bits >>= 4) {
    if ((bits & 15) == 0) continue;
    __m128 d = _mm_add_ps(_mm_set1_ps(centre),
                          _mm_add_ps(_mm_mul_ps(_mm_set1_ps(gx), _mm_load_ps(&pattern.x[k])),
                                     _mm_mul_ps(_mm_set1_ps(gy), _mm_load_ps(&pattern.y[k]))));
    d = _mm_min_ps(_mm_max_ps(d, _mm_set1_ps(far)), _mm_set1_ps(near));
    const __m128i wanted =
        _mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(static_cast<int>(bits)), lanes), lanes);
    const __m128 old = _mm_load_ps(depth + k);
    const __m128 wins = _mm_and_ps(_mm_castsi128_ps(wanted), _mm_cmpgt_ps(d, old));
    _mm_store_ps(depth + k, _mm_or_ps(_mm_and_ps(wins, d), _mm_andnot_ps(wins, old)));
    const __m128i keep = _mm_castps_si128(wins);
    auto* at = reinterpret_cast<__m128i*>(triangle + k);
    _mm_store_si128(at, _mm_or_si128(_mm_and_si128(keep, _mm_set1_epi32(static_cast<int>(index))),
                                     _mm_andnot_si128(keep, _mm_load_si128(at))));
  }
#else
  for (int k = 0; k < depth_samples; ++k) {
    if (!(bits >> k & 1)) continue;
    const float d = std::min(std::max(centre + (gx * pattern.x[k] + gy * pattern.y[k]), far), near);
    if (d > depth[k]) {
      depth[k] = d;
      triangle[k] = index;
    }
  }
#endif
}

}  // namespace polyhull::coverage
