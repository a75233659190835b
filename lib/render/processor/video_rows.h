// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rows of a picture on their way to video: drawn over a copy of the background that stays in the
/// cache, then converted where something was drawn.
#pragma once

#include <climits>
#include <cstdint>

#include "render/yuv/yuv_picture.h"

namespace polyhull::processor {

/// Where a picture goes: RGBA pixels, or video.
struct PictureTarget {
  std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  const YuvPicture* video = nullptr;  ///< pixels is null then
};

/// RGBA pixels to draw into, from column left and row top on.
struct PixelRows {
  std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  int left = 0, top = 0;
  std::uint8_t* at(int x, int y) const { return pixels + (y - top) * stride + 4 * (x - left); }
};

/// The columns left .. right - 1 that drawing has reached.
struct Touched {
  int left = INT_MAX, right = 0;
};

/// The background of \p part of a picture of \p width x \p height and of the pixels that share its
/// chroma. The calling thread's own, until the next call.
PixelRows background_rows(const std::uint8_t* background, std::ptrdiff_t stride,
                          const Rectangle& part, int width, int height);

/// Writes the columns \p touched of rows \p y (even) and y + 1 to \p target.
void write_rows(const PixelRows& rows, int y, const Touched& touched, const YuvPicture& target);

}  // namespace polyhull::processor
