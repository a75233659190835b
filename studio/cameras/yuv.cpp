// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/yuv.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr int fraction = 16;  // bits of the coefficients

struct Row {
  int r, g, b;
};
struct Matrix {
  Row y, cb, cr;
  int y_offset;
};

Matrix make_matrix(const YuvCoding& c) {
  const double kg = 1.0 - c.kr - c.kb;
  const double y = c.full_range ? 1.0 : 219.0 / 255.0, chroma = c.full_range ? 1.0 : 224.0 / 255.0;
  const auto fixed = [](double v) { return static_cast<int>(std::lround(v * (1 << fraction))); };
  const double b = 0.5 / (1.0 - c.kb) * chroma, r = 0.5 / (1.0 - c.kr) * chroma;
  Matrix m{};
  m.y = {fixed(y * c.kr), fixed(y * kg), fixed(y * c.kb)};
  m.cb = {fixed(-b * c.kr), fixed(-b * kg), fixed(b * (1.0 - c.kb))};
  m.cr = {fixed(r * (1.0 - c.kr)), fixed(-r * kg), fixed(-r * c.kb)};
  // A grey must give exactly neutral chroma: rounding goes to green.
  m.cb.g = -m.cb.r - m.cb.b;
  m.cr.g = -m.cr.r - m.cr.b;
  m.y_offset = c.full_range ? 0 : 16;
  return m;
}

#ifdef __SSE2__

__m128i load(const void* at) {
  return _mm_loadu_si128(static_cast<const __m128i*>(at));
}

/// A factor of 17 bits as two of 16 in one lane of 32.
int halves(int factor) {
  const int half = factor / 2;
  return (half & 0xffff) | (factor - half) << 16;
}

/// The luma of pixels 0, 4, 8, .. as far as whole registers go; returns how many that are.
int luma_of_four(const std::uint8_t* p, int width, const Matrix& m, std::uint8_t* out, int step) {
  const __m128i low = _mm_set1_epi32(255), red = _mm_set1_epi32(halves(m.y.r)),
                green = _mm_set1_epi32(halves(m.y.g)), blue = _mm_set1_epi32(halves(m.y.b)),
                half = _mm_set1_epi32(1 << (fraction - 1)), offset = _mm_set1_epi32(m.y_offset);
  const auto twice = [&](const __m128i& v) { return _mm_or_si128(v, _mm_slli_epi32(v, 16)); };
  int x = 0;
  for (; x + 4 <= width; x += 4) {
    const __m128i v = load(p + 4 * static_cast<std::size_t>(x));
    const __m128i r = twice(_mm_and_si128(v, low)),
                  g = twice(_mm_and_si128(_mm_srli_epi32(v, 8), low)),
                  b = twice(_mm_and_si128(_mm_srli_epi32(v, 16), low));
    __m128i sum = _mm_add_epi32(_mm_madd_epi16(r, red), _mm_madd_epi16(g, green));
    sum = _mm_add_epi32(_mm_add_epi32(sum, _mm_madd_epi16(b, blue)), half);
    sum = _mm_add_epi32(_mm_srli_epi32(sum, fraction), offset);
    sum = _mm_packs_epi32(sum, sum);
    const auto bytes = static_cast<std::uint32_t>(_mm_cvtsi128_si32(_mm_packus_epi16(sum, sum)));
    if (step == 1) {
      std::memcpy(out + x, &bytes, 4);
    } else {
      for (int k = 0; k < 4; ++k) out[(x + k) * step] = static_cast<std::uint8_t>(bytes >> (8 * k));
    }
  }
  return x;
}

/// Adds the colours of four pixels at a time to \p sums, or writes them there.
int sum_of_four(const std::uint8_t* p, int width, bool first, std::uint16_t* sums) {
  const __m128i none = _mm_setzero_si128();
  int x = 0;
  for (; x + 4 <= width; x += 4) {
    const __m128i v = load(p + 4 * static_cast<std::size_t>(x));
    auto* to = reinterpret_cast<__m128i*>(sums + 4 * static_cast<std::size_t>(x));
    __m128i low = _mm_unpacklo_epi8(v, none), high = _mm_unpackhi_epi8(v, none);
    if (!first) {
      low = _mm_add_epi16(low, load(to));
      high = _mm_add_epi16(high, load(to + 1));
    }
    _mm_storeu_si128(to, low);
    _mm_storeu_si128(to + 1, high);
  }
  return x;
}

/// The chroma of two pairs of columns at a time; returns how many columns that are.
int chroma_of_four(const std::uint16_t* sums, int width, const Matrix& m, bool left_sited,
                   int shift, std::uint8_t* cb, std::uint8_t* cr, int step) {
  // Four lanes of 16 bits a pixel: Cb takes blue twice, Cr red, with half of its factor each.
  const auto factors = [](int a, int b, int c, int d) {
    return _mm_set1_epi64x(static_cast<long long>(static_cast<std::uint16_t>(a)) |
                           static_cast<long long>(static_cast<std::uint16_t>(b)) << 16 |
                           static_cast<long long>(static_cast<std::uint16_t>(c)) << 32 |
                           static_cast<long long>(static_cast<std::uint16_t>(d)) << 48);
  };
  const __m128i blue = factors(m.cb.r, m.cb.g, m.cb.b / 2, m.cb.b - m.cb.b / 2),
                red = factors(m.cr.r / 2, m.cr.g, m.cr.b, m.cr.r - m.cr.r / 2);
  const __m128i half = _mm_set1_epi32(1 << (fraction + shift - 1)), middle = _mm_set1_epi32(128);
  const __m128i places = _mm_cvtsi32_si128(fraction + shift);
  int x = 0;
  for (; x + 4 <= width; x += 4) {
    const std::uint16_t* at = sums + 4 * static_cast<std::ptrdiff_t>(x);
    const __m128i two = load(at), next = load(at + 8);
    const __m128i here = _mm_unpacklo_epi64(two, next), right = _mm_unpackhi_epi64(two, next);
    __m128i c = _mm_add_epi16(here, right);
    if (left_sited)
      c = _mm_add_epi16(_mm_add_epi16(c, here), _mm_unpacklo_epi64(load(at - 4), load(at + 4)));
    const __m128i twice_blue = _mm_shufflehi_epi16(_mm_shufflelo_epi16(c, 0xa4), 0xa4);
    const __m128i twice_red = _mm_shufflehi_epi16(_mm_shufflelo_epi16(c, 0x24), 0x24);
    const __m128i b = _mm_madd_epi16(twice_blue, blue), r = _mm_madd_epi16(twice_red, red);
    const __m128i first = _mm_unpacklo_epi32(b, r), second = _mm_unpackhi_epi32(b, r);
    __m128i sum =
        _mm_add_epi32(_mm_unpacklo_epi64(first, second), _mm_unpackhi_epi64(first, second));
    sum = _mm_add_epi32(_mm_sra_epi32(_mm_add_epi32(sum, half), places), middle);
    sum = _mm_packs_epi32(sum, sum);
    const auto bytes = static_cast<std::uint32_t>(_mm_cvtsi128_si32(_mm_packus_epi16(sum, sum)));
    cb[x / 2 * step] = static_cast<std::uint8_t>(bytes);
    cr[x / 2 * step] = static_cast<std::uint8_t>(bytes >> 8);
    cb[(x / 2 + 1) * step] = static_cast<std::uint8_t>(bytes >> 16);
    cr[(x / 2 + 1) * step] = static_cast<std::uint8_t>(bytes >> 24);
  }
  return x;
}

#else

int chroma_of_four(const std::uint16_t*, int, const Matrix&, bool, int, std::uint8_t*,
                   std::uint8_t*, int) {
  return 0;
}

int luma_of_four(const std::uint8_t*, int, const Matrix&, std::uint8_t*, int) {
  return 0;
}

int sum_of_four(const std::uint8_t*, int, bool, std::uint16_t*) {
  return 0;
}

#endif

std::uint8_t chroma_byte(const Row& row, int r, int g, int b, int shift) {
  const int value = row.r * r + row.g * g + row.b * b;
  const int half = 1 << (fraction + shift - 1);
  return static_cast<std::uint8_t>(
      std::clamp(((value + half) >> (fraction + shift)) + 128, 0, 255));
}

/// One row of chroma from the sums of \p rows (1 or 2) rows of RGBx in \p sums, in which the pixels
/// beside the first and the last are repeated.
void write_chroma(const std::uint16_t* sums, int rows, int width, const Matrix& m, bool left_sited,
                  std::uint8_t* cb, std::uint8_t* cr, int step) {
  const int shift = (rows == 2) + (left_sited ? 2 : 1);
  for (int x = chroma_of_four(sums, width, m, left_sited, shift, cb, cr, step); x < width; x += 2) {
    const std::uint16_t* here = sums + 4 * static_cast<std::ptrdiff_t>(x);
    const std::uint16_t *left = here - 4, *right = here + 4;
    int c[3];
    for (int k = 0; k < 3; ++k)
      c[k] = left_sited ? left[k] + 2 * here[k] + right[k] : here[k] + right[k];
    cb[x / 2 * step] = chroma_byte(m.cb, c[0], c[1], c[2], shift);
    cr[x / 2 * step] = chroma_byte(m.cr, c[0], c[1], c[2], shift);
  }
}

}  // namespace

void rgba_to_yuv(const std::uint8_t* rgba, std::ptrdiff_t stride, int width, int height,
                 const YuvCoding& coding, const YuvTarget& target) {
  const Matrix m = make_matrix(coding);
  const int rows = target.half_height ? 2 : 1;
  const int pairs = (height + rows - 1) / rows;
  parallel_for(pairs, 16, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint16_t> memory(4 * (static_cast<std::size_t>(width) + 2));
    std::uint16_t* const sums = memory.data() + 4;
    for (int pair = static_cast<int>(begin); pair < static_cast<int>(end); ++pair) {
      for (int i = 0; i < rows; ++i) {
        const int y = std::min(pair * rows + i, height - 1);
        const std::uint8_t* row = rgba + y * stride;
        std::uint8_t* out = target.y + y * target.y_stride;
        for (int x = luma_of_four(row, width, m, out, target.y_step); x < width; ++x) {
          const std::uint8_t* p = row + 4 * static_cast<std::size_t>(x);
          const int luma = m.y.r * p[0] + m.y.g * p[1] + m.y.b * p[2] + (1 << (fraction - 1));
          out[x * target.y_step] =
              static_cast<std::uint8_t>(std::min((luma >> fraction) + m.y_offset, 255));
        }
        for (int x = 4 * sum_of_four(row, width, i == 0, sums); x < 4 * width; ++x)
          sums[x] = static_cast<std::uint16_t>(i == 0 ? row[x] : sums[x] + row[x]);
      }
      std::copy_n(sums, 4, sums - 4);
      std::copy_n(sums + 4 * (width - 1), 4, sums + 4 * width);
      write_chroma(sums, rows, width, m, coding.left_sited, target.cb + pair * target.chroma_stride,
                   target.cr + pair * target.chroma_stride, target.chroma_step);
    }
  });
}

}  // namespace polyhull
