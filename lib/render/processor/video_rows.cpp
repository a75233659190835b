// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/video_rows.h"

#include <algorithm>
#include <cstring>
#include <vector>

namespace polyhull::processor {

PixelRows background_rows(const std::uint8_t* background, std::ptrdiff_t stride,
                          const Rectangle& part, int width, int height) {
  thread_local std::vector<std::uint8_t> rows;
  const Rectangle all = yuv_part(part, width, height);
  const int left = std::max(all.x - 1, 0);
  const std::size_t row = 4 * static_cast<std::size_t>(all.x + all.width - left);
  rows.resize(row * static_cast<std::size_t>(all.height));
  for (int y = 0; y < all.height; ++y)
    std::memcpy(rows.data() + row * static_cast<std::size_t>(y),
                background + (all.y + y) * stride + 4 * left, row);
  return {rows.data(), static_cast<std::ptrdiff_t>(row), left, all.y};
}

void write_rows(const PixelRows& rows, int y, const Touched& touched, const YuvPicture& target) {
  if (touched.left >= touched.right) return;
  const Rectangle part =
      yuv_part({touched.left, y, touched.right - touched.left, 2}, target.width, target.height);
  write_yuv({rows.pixels, rows.stride, rows.left, rows.top}, part, target);
}

}  // namespace polyhull::processor
