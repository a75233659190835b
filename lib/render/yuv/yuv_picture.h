// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures as encoders take them: Y'CbCr 4:2:0 in 8 bits of limited range, ITU-R BT.709.
///
///   Y' = 0.2126 R + 0.7152 G + 0.0722 B, Cb = (B - Y') / 1.8556, Cr = (R - Y') / 1.5748
///
/// Chroma lies on the even columns and between two rows, as H.264 takes it to lie where nothing is
/// said: it is of the mean of two rows, weighted 1:2:1 over three columns. Odd sizes repeat the last
/// column and row. Alpha is left out. Rounded to the nearest; the same bytes on every processor.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vector.h"

namespace polyhull {

/// The planes of a 4:2:0 picture. Strides in bytes.
struct YuvPicture {
  int width = 0, height = 0;  ///< of luma; chroma has half of both, rounded up
  std::uint8_t* y = nullptr;
  std::ptrdiff_t y_stride = 0;
  std::uint8_t* cb = nullptr;
  std::uint8_t* cr = nullptr;  ///< where chroma_step is 2, cb + 1
  std::ptrdiff_t chroma_stride = 0;
  int chroma_step = 1;  ///< from one sample to the next in a row: 1 (I420) or 2 (NV12)
};

/// RGBA pixels of a picture, from column left and row top on, \p stride bytes from row to row.
struct RgbaPart {
  const std::uint8_t* pixels = nullptr;
  std::ptrdiff_t stride = 0;
  int left = 0, top = 0;
};

/// What of a 4:2:0 picture of \p width x \p height changes with the pixels \p changed.
Rectangle yuv_part(const Rectangle& changed, int width, int height);

/// Writes \p part, which is one of yuv_part(), of \p to. \p from holds it, and the column to the left
/// of it where there is one.
void write_yuv(const RgbaPart& from, const Rectangle& part, const YuvPicture& to);

/// Writes all of \p to from the RGBA picture \p rgba, whose rows are \p stride bytes apart; on the
/// pool's threads.
void write_yuv(const std::uint8_t* rgba, std::ptrdiff_t stride, const YuvPicture& to);

}  // namespace polyhull
