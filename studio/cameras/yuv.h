// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// RGB to Y'CbCr with subsampled chroma, as cameras deliver it.
///
/// Y' = Kr R + (1 - Kr - Kb) G + Kb B, Cb = (B - Y') / (2 (1 - Kb)), Cr = (R - Y') / (2 (1 - Kr)),
/// in 8 bits of full or limited range (ITU-R BT.601, BT.709). Chroma is taken from the mean colour
/// of the pixels that share it: two columns, or 1:2:1 over three where it is sited on the left
/// column; and two rows in 4:2:0.
#pragma once

#include <cstddef>
#include <cstdint>

namespace polyhull {

struct YuvCoding {
  double kr = 0.299;
  double kb = 0.114;
  bool full_range = false;
  bool left_sited = false;  ///< chroma lies on even columns, as in MPEG-2; else between two columns
};

/// Where the components of one picture go. Offsets and strides in bytes.
struct YuvTarget {
  std::uint8_t* y = nullptr;
  std::ptrdiff_t y_stride = 0;
  int y_step = 1;  ///< from one pixel to the next
  std::uint8_t* cb = nullptr;
  std::uint8_t* cr = nullptr;
  std::ptrdiff_t chroma_stride = 0;
  int chroma_step = 1;       ///< from one chroma sample to the next in a row
  bool half_height = false;  ///< 4:2:0, else 4:2:2
};

/// Converts \p width x \p height RGBA pixels. Odd sizes repeat the last column and row for chroma.
/// Rows are spread over the pool's threads.
void rgba_to_yuv(const std::uint8_t* rgba, std::ptrdiff_t stride, int width, int height,
                 const YuvCoding& coding, const YuvTarget& target);

}  // namespace polyhull
