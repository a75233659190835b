// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/yuv/yuv_picture.h"

#include <algorithm>
#include <cstring>

#include "base/thread_pool.h"
#include "render/yuv/loops.h"

namespace polyhull {
namespace {

/// The chroma of \p count pairs of columns from column \p x on.
void write_chroma(const std::uint8_t* top, const std::uint8_t* bottom, int count, int x, int y,
                  const YuvPicture& to) {
  const std::ptrdiff_t at = y / 2 * to.chroma_stride + x / 2 * to.chroma_step;
  if (to.chroma_step == 2) {
    yuv::Loops::best().chroma_in_turn(top, bottom, count, to.cb + at);
  } else {
    yuv::Loops::best().chroma(top, bottom, count, to.cb + at, to.cr + at);
  }
}

/// One pair at the picture's edge: what lies outside is as the pixel that is its middle.
void write_edge_chroma(const std::uint8_t* top, const std::uint8_t* bottom, int x, int y,
                       const YuvPicture& to) {
  std::uint8_t rows[2][12];
  const std::uint8_t* from[2] = {top, bottom};
  for (int row = 0; row < 2; ++row)
    for (int i = -1; i <= 1; ++i)
      std::memcpy(rows[row] + 4 * (i + 1), from[row] + 4 * (std::clamp(x + i, 0, to.width - 1) - x),
                  4);
  write_chroma(rows[0] + 4, rows[1] + 4, 1, x, y, to);
}

}  // namespace

Rectangle yuv_part(const Rectangle& changed, int width, int height) {
  if (changed.empty()) return {};
  // A pixel of an odd column has a share in the pairs on both its sides.
  const int left = changed.x & ~1, top = changed.y & ~1;
  const int right = std::min((changed.x + changed.width + 2) & ~1, width);
  const int bottom = std::min((changed.y + changed.height + 1) & ~1, height);
  return {left, top, right - left, bottom - top};
}

void write_yuv(const RgbaPart& from, const Rectangle& part, const YuvPicture& to) {
  const int right = part.x + part.width, bottom = part.y + part.height;
  const auto at = [&](int x, int y) {
    return from.pixels + (y - from.top) * from.stride + 4 * (x - from.left);
  };
  for (int y = part.y; y < bottom; y += 2) {
    const int second = std::min(y + 1, to.height - 1);
    for (int row = y; row <= second; ++row)
      yuv::Loops::best().luma(at(part.x, row), part.width, to.y + row * to.y_stride + part.x);
    int first = part.x, last = right;
    if (first == 0) {
      write_edge_chroma(at(0, y), at(0, second), 0, y, to);
      first = 2;
    }
    if (right % 2 != 0 && right > 1) {
      last = right - 1;
      write_edge_chroma(at(last, y), at(last, second), last, y, to);
    }
    if (first < last)
      write_chroma(at(first, y), at(first, second), (last - first) / 2, first, y, to);
  }
}

void write_yuv(const std::uint8_t* rgba, std::ptrdiff_t stride, const YuvPicture& to) {
  constexpr int rows = 32;  // a piece that stays in the cache between luma and chroma
  const auto pieces = static_cast<std::size_t>((to.height + rows - 1) / rows);
  parallel_for(pieces, 1, 0, [&](std::size_t begin, std::size_t end) {
    const int top = static_cast<int>(begin) * rows;
    const int bottom = std::min(static_cast<int>(end) * rows, to.height);
    write_yuv(RgbaPart{rgba, stride, 0, 0}, {0, top, to.width, bottom - top}, to);
  });
}

}  // namespace polyhull
