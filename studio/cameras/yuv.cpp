// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/yuv.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

std::uint8_t chroma_byte(const Row& row, int r, int g, int b, int shift) {
  const int value = row.r * r + row.g * g + row.b * b;
  const int half = 1 << (fraction + shift - 1);
  return static_cast<std::uint8_t>(
      std::clamp(((value + half) >> (fraction + shift)) + 128, 0, 255));
}

/// One row of chroma from the sums of \p rows (1 or 2) rows of RGB in \p sums.
void write_chroma(const std::vector<std::uint16_t>& sums, int rows, int width, const Matrix& m,
                  bool left_sited, std::uint8_t* cb, std::uint8_t* cr, int step) {
  const int shift = (rows == 2) + (left_sited ? 2 : 1);
  for (int x = 0; x < width; x += 2) {
    const std::uint16_t* here = &sums[3 * static_cast<std::size_t>(x)];
    const std::uint16_t* right = x + 1 < width ? here + 3 : here;
    int c[3];
    if (left_sited) {
      const std::uint16_t* left = x > 0 ? here - 3 : here;
      for (int k = 0; k < 3; ++k) c[k] = left[k] + 2 * here[k] + right[k];
    } else {
      for (int k = 0; k < 3; ++k) c[k] = here[k] + right[k];
    }
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
    std::vector<std::uint16_t> sums(3 * static_cast<std::size_t>(width));
    for (int pair = static_cast<int>(begin); pair < static_cast<int>(end); ++pair) {
      for (int i = 0; i < rows; ++i) {
        const int y = std::min(pair * rows + i, height - 1);
        const std::uint8_t* p = rgba + y * stride;
        std::uint8_t* out = target.y + y * target.y_stride;
        for (int x = 0; x < width; ++x, p += 4) {
          const int luma = m.y.r * p[0] + m.y.g * p[1] + m.y.b * p[2] + (1 << (fraction - 1));
          out[x * target.y_step] =
              static_cast<std::uint8_t>(std::min((luma >> fraction) + m.y_offset, 255));
          for (int k = 0; k < 3; ++k)
            sums[3 * x + k] = static_cast<std::uint16_t>(i == 0 ? p[k] : sums[3 * x + k] + p[k]);
        }
      }
      write_chroma(sums, rows, width, m, coding.left_sited, target.cb + pair * target.chroma_stride,
                   target.cr + pair * target.chroma_stride, target.chroma_step);
    }
  });
}

}  // namespace polyhull
