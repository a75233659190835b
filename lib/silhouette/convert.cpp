// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>
#include <cstring>

#include "silhouette/chroma.h"
#include "silhouette/frame.h"

namespace polyhull {
namespace silhouette {

ChromaRows chroma_rows(const FrameView& frame, int y) {
  if (frame.format == FrameFormat::yuy2 || frame.format == FrameFormat::uyvy) return {y, y, 4, 0};
  const int last = (frame.height + 1) / 2 - 1;
  ChromaRows rows;
  rows.near_row = y / 2;
  if (frame.site == ChromaSite::top_left) {
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
  const double unit = frame.format == FrameFormat::i420_10le ? 4.0 : 1.0;
  const double largest = frame.format == FrameFormat::i420_10le ? 1023.0 : 255.0;
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

namespace {

// Samples as stored, chroma vertically weighted (times 4).
struct Sampler {
  const FrameView& frame;
  ChromaRows rows;
  int y;

  int luma(int x) const {
    switch (frame.format) {
      case FrameFormat::yuy2:
        return frame.row(0, y)[2 * x];
      case FrameFormat::uyvy:
        return frame.row(0, y)[2 * x + 1];
      case FrameFormat::i420_10le:
        return word(frame.row(0, y), x);
      default:
        return frame.row(0, y)[x];
    }
  }
  void chroma(int i, int& cb, int& cr) const {
    int cb0, cr0, cb1, cr1;
    raw(rows.near_row, i, cb0, cr0);
    raw(rows.far_row, i, cb1, cr1);
    cb = rows.near_weight * cb0 + rows.far_weight * cb1;
    cr = rows.near_weight * cr0 + rows.far_weight * cr1;
  }

 private:
  static int word(const std::uint8_t* row, int i) { return row[2 * i] | (row[2 * i + 1] & 3) << 8; }
  void raw(int row, int i, int& cb, int& cr) const {
    switch (frame.format) {
      case FrameFormat::i420:
        cb = frame.row(1, row)[i];
        cr = frame.row(2, row)[i];
        return;
      case FrameFormat::nv12:
        cb = frame.row(1, row)[2 * i];
        cr = frame.row(1, row)[2 * i + 1];
        return;
      case FrameFormat::yuy2:
        cb = frame.row(0, row)[4 * i + 1];
        cr = frame.row(0, row)[4 * i + 3];
        return;
      case FrameFormat::uyvy:
        cb = frame.row(0, row)[4 * i];
        cr = frame.row(0, row)[4 * i + 2];
        return;
      default:
        cb = word(frame.row(1, row), i);
        cr = word(frame.row(2, row), i);
    }
  }
};

void convert_yuv(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba) {
  const ColourCoefficients c = colour_coefficients(frame);
  // 2^12 for luma and 2^8 for chroma, which comes 16 times too large.
  const auto fixed = [](double v) { return static_cast<std::int32_t>(std::lround(v * 4096.0)); };
  const std::int32_t luma_gain = fixed(c.luma_gain);
  std::int32_t cb_gain[3], cr_gain[3];
  for (int i = 0; i < 3; ++i) {
    cb_gain[i] = static_cast<std::int32_t>(std::lround(c.cb[i] * 1024.0));
    cr_gain[i] = static_cast<std::int32_t>(std::lround(c.cr[i] * 1024.0));
  }
  const int luma_zero = static_cast<int>(c.luma_zero);
  const int chroma_zero = static_cast<int>(c.chroma_zero) * 16;
  const Sampler sampler{frame, chroma_rows(frame, y), y};
  const int last = chroma_width(frame) - 1;
  int held = -1, cb_a = 0, cr_a = 0, cb_b = 0, cr_b = 0;
  for (int x = x0; x < x1; ++x) {
    // Left and right sample of the pair between which x lies, with weights of quarters.
    int left, weight;
    if (frame.site == ChromaSite::centre) {
      left = (x + 1) / 2 - 1;
      weight = (x & 1) ? 1 : 3;
    } else {
      left = x / 2;
      weight = (x & 1) ? 2 : 0;
    }
    if (left != held || x == x0) {
      sampler.chroma(std::clamp(left, 0, last), cb_a, cr_a);
      sampler.chroma(std::clamp(left + 1, 0, last), cb_b, cr_b);
      held = left;
    }
    const int cb = (4 - weight) * cb_a + weight * cb_b - chroma_zero;
    const int cr = (4 - weight) * cr_a + weight * cr_b - chroma_zero;
    const std::int32_t luma = luma_gain * (sampler.luma(x) - luma_zero) * 4;
    for (int i = 0; i < 3; ++i) {
      const std::int32_t v = (luma + cb_gain[i] * cb + cr_gain[i] * cr + 8192) >> 14;
      rgba[i] = static_cast<std::uint8_t>(std::clamp(v, 0, 255));
    }
    rgba[3] = 255;
    rgba += 4;
  }
}

}  // namespace
}  // namespace silhouette

void convert_row(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba) {
  if (is_yuv(frame.format)) return silhouette::convert_yuv(frame, y, x0, x1, rgba);
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
