// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>
#include <cstring>

#include "silhouette/pixels/chroma.h"
#include "silhouette/pixels/colour_kernels.h"
#include "silhouette/pixels/frame.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull {
namespace silhouette {

ChromaRows chroma_rows(const FrameView& frame, int y) {
  if (!halved_down(frame)) return {y, y, 4, 0};
  const int last = (frame.height + 1) / 2 - 1;
  ChromaRows rows;
  rows.near_row = y / 2;
  if (frame.site == ChromaSite::top_left || frame.site == ChromaSite::top) {
    rows.far_row = std::min(rows.near_row + (y & 1), last);
    if (y & 1) rows.near_weight = rows.far_weight = 2;
  } else {
    rows.far_row = std::clamp(rows.near_row + ((y & 1) ? 1 : -1), 0, last);
    rows.near_weight = 3;
    rows.far_weight = 1;
  }
  return rows;
}

ColourCoefficients colour_coefficients(const FrameView& frame) {
  double kr = 0.299, kb = 0.114;
  if (frame.matrix == ColourMatrix::bt709) kr = 0.2126, kb = 0.0722;
  if (frame.matrix == ColourMatrix::bt2020) kr = 0.2627, kb = 0.0593;
  const double kg = 1.0 - kr - kb;
  const double unit = is_deep(frame) ? 4.0 : 1.0;
  const double largest = is_deep(frame) ? 1023.0 : 255.0;
  ColourCoefficients out{};
  out.luma_gain = frame.full_range ? 255.0 / largest : 255.0 / (219.0 * unit);
  out.luma_zero = frame.full_range ? 0.0 : 16.0 * unit;
  out.chroma_zero = 128.0 * unit;
  const double chroma_gain = frame.full_range ? 255.0 / largest : 255.0 / (224.0 * unit);
  out.cr[0] = chroma_gain * 2.0 * (1.0 - kr);
  out.cb[2] = chroma_gain * 2.0 * (1.0 - kb);
  out.cr[1] = -out.cr[0] * kr / kg;
  out.cb[1] = -out.cb[2] * kb / kg;
  return out;
}

}  // namespace silhouette

namespace {

void convert_described_rgb(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba) {
  const SampleLayout& s = frame.samples;
  for (int c = 0; c < 3; ++c) {
    const auto [plane, offset, step] = s.components[c];
    const std::uint8_t* from = frame.row(plane, y) + offset;
    for (int x = x0; x < x1; ++x) {
      const std::uint8_t* p = from + static_cast<std::ptrdiff_t>(x) * step;
      std::uint8_t& out = rgba[4 * (x - x0) + c];
      if (s.bits <= 8) {
        out = p[0];
        continue;
      }
      const int most = (1 << s.bits) - 1, sample = (p[0] | p[1] << 8) >> s.shift & most;
      out = static_cast<std::uint8_t>((sample * 255 + most / 2) / most);
    }
  }
  for (int x = 0; x < x1 - x0; ++x) rgba[4 * x + 3] = 255;
}

}  // namespace

void convert_row(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba) {
  if (frame.format == FrameFormat::described && frame.samples.rgb)
    return convert_described_rgb(frame, y, x0, x1, rgba);
  if (is_yuv(frame.format))
    return silhouette::ColourKernels::best().convert_yuv(frame, y, x0, x1, rgba);
  if (bayer_bits(frame.format) > 0)
    return silhouette::ColourKernels::best().convert_bayer(frame, y, x0, x1, rgba);
  const std::uint8_t* from = frame.row(0, y);
  const auto each = [&](int step, int r, int g, int b) {
    for (int x = x0; x < x1; ++x, rgba += 4) {
      const std::uint8_t* p = from + static_cast<std::ptrdiff_t>(x) * step;
      const std::uint8_t red = p[r], green = p[g], blue = p[b];
      rgba[0] = red;
      rgba[1] = green;
      rgba[2] = blue;
      rgba[3] = 255;
    }
  };
  switch (frame.format) {
    case FrameFormat::rgbx:
    case FrameFormat::rgba:
      return each(4, 0, 1, 2);
    case FrameFormat::bgrx:
    case FrameFormat::bgra:
      return each(4, 2, 1, 0);
    case FrameFormat::rgb:
      return each(3, 0, 1, 2);
    case FrameFormat::bgr:
      return each(3, 2, 1, 0);
    default:
      return each(1, 0, 0, 0);
  }
}

}  // namespace polyhull
