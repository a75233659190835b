// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames for the keyer's tests: any colour function as any camera format.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "silhouette/pixels/frame.h"

namespace polyhull::test {

using Colour = std::array<double, 3>;

struct Frame {
  FrameView view;
  std::array<std::vector<std::uint8_t>, 3> planes;
  Frame() = default;
  Frame(const Frame&) = delete;
  Frame(Frame&&) = default;
  Frame& operator=(Frame&&) = default;
};

/// Which channel a mosaic has at a pixel: the letters of its order, read row by row.
inline int mosaic_channel(BayerOrder order, int x, int y) {
  constexpr std::array letters = {"bggr", "gbrg", "grbg", "rggb"};
  const char letter = letters[static_cast<std::size_t>(order)][2 * (y & 1) + (x & 1)];
  return letter == 'r' ? 0 : letter == 'g' ? 1 : 2;
}

/// Packs a picture given by colour(x, y) in levels; strides are longer than the rows by `slack`
/// bytes.
inline Frame make_frame(FrameFormat format, int width, int height,
                        const std::function<Colour(int, int)>& colour,
                        ColourMatrix matrix = ColourMatrix::bt601, bool full_range = false,
                        int slack = 6, BayerOrder bayer = BayerOrder::rggb) {
  Frame frame;
  FrameView& v = frame.view;
  v.format = format;
  v.width = width;
  v.height = height;
  v.matrix = matrix;
  v.full_range = full_range;
  const auto allocate = [&](int plane, int row_bytes, int rows) {
    v.strides[plane] = row_bytes + slack;
    frame.planes[plane].assign(static_cast<std::size_t>(row_bytes + slack) * rows, 77);
    v.planes[plane] = frame.planes[plane].data();
  };
  const auto byte = [](double x) {
    return static_cast<std::uint8_t>(std::clamp(std::lround(x), 0l, 255l));
  };
  std::vector<Colour> rgb(static_cast<std::size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) rgb[static_cast<std::size_t>(y) * width + x] = colour(x, y);
  const auto at = [&](int x, int y) {
    return rgb[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * width +
               std::clamp(x, 0, width - 1)];
  };
  if (const int bits = bayer_bits(format); bits > 0) {
    v.bayer = bayer;
    const int bytes = bits > 8 ? 2 : 1;
    allocate(0, width * bytes, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const double level = at(x, y)[static_cast<std::size_t>(mosaic_channel(bayer, x, y))];
        const long most = (1l << bits) - 1;
        const long sample = std::clamp(std::lround(std::ldexp(level, bits - 8)), 0l, most);
        std::uint8_t* p =
            frame.planes[0].data() + static_cast<std::size_t>(y) * v.strides[0] + x * bytes;
        p[0] = static_cast<std::uint8_t>(sample & 255);
        if (bytes == 2) p[1] = static_cast<std::uint8_t>(sample >> 8);
      }
    return frame;
  }
  if (!is_yuv(format)) {
    const int step = format == FrameFormat::gray8                               ? 1
                     : format == FrameFormat::rgb || format == FrameFormat::bgr ? 3
                                                                                : 4;
    const bool reversed =
        format == FrameFormat::bgrx || format == FrameFormat::bgra || format == FrameFormat::bgr;
    allocate(0, width * step, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < std::min(step, 3); ++c)
          frame.planes[0][static_cast<std::size_t>(y) * v.strides[0] + x * step +
                          (reversed ? 2 - c : c)] =
              byte(step == 1 ? (at(x, y)[0] + at(x, y)[1] + at(x, y)[2]) / 3 : at(x, y)[c]);
    return frame;
  }
  double kr = 0.299, kb = 0.114;
  if (matrix == ColourMatrix::bt709) kr = 0.2126, kb = 0.0722;
  if (matrix == ColourMatrix::bt2020) kr = 0.2627, kb = 0.0593;
  const bool ten = is_ten_bit(format);
  const double unit = ten ? 4.0 : 1.0, top = ten ? 1023.0 : 255.0;
  const auto luma_of = [&](const Colour& c) {
    return (kr * c[0] + (1 - kr - kb) * c[1] + kb * c[2]) / 255.0;
  };
  const auto luma = [&](int x, int y) {
    const double l = luma_of(at(x, y));
    return full_range ? l * top : (16.0 + 219.0 * l) * unit;
  };
  const bool halved = !is_422(format);
  // Chroma sited left: weights 1 2 1 around the even column, both rows in 4:2:0.
  const auto chroma = [&](int i, int j, int which) {
    double sum = 0.0, weight = 0.0;
    for (int dy = 0; dy < (halved ? 2 : 1); ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const Colour c = at(2 * i + dx, halved ? 2 * j + dy : j);
        const double d = which == 0 ? (c[2] / 255.0 - luma_of(c)) / (2 * (1 - kb))
                                    : (c[0] / 255.0 - luma_of(c)) / (2 * (1 - kr));
        sum += d * (dx == 0 ? 2.0 : 1.0);
        weight += dx == 0 ? 2.0 : 1.0;
      }
    return 128.0 * unit + sum / weight * (full_range ? top : 224.0 * unit);
  };
  const int cw = (width + 1) / 2, ch = (height + 1) / 2;
  if (format == FrameFormat::yuy2 || format == FrameFormat::uyvy) {
    const int first = format == FrameFormat::yuy2 ? 0 : 1;
    allocate(0, 4 * cw, height);
    for (int y = 0; y < height; ++y)
      for (int i = 0; i < cw; ++i) {
        std::uint8_t* p =
            frame.planes[0].data() + static_cast<std::size_t>(y) * v.strides[0] + 4 * i;
        p[first] = byte(luma(2 * i, y));
        p[first + 2] = byte(luma(2 * i + 1, y));
        p[1 - first] = byte(chroma(i, y, 0));
        p[3 - first] = byte(chroma(i, y, 1));
      }
    return frame;
  }
  if (format == FrameFormat::v210) {
    allocate(0, (width + 5) / 6 * 16, height);
    for (int y = 0; y < height; ++y)
      for (int k = 0; k < 4 * cw; ++k) {  // Cb, Y, Cr, Y
        const double value = k % 2 ? luma(k / 2, y) : chroma(k / 4, y, k / 2 % 2);
        std::uint8_t* word =
            frame.planes[0].data() + static_cast<std::size_t>(y) * v.strides[0] + k / 3 * 4;
        const std::uint32_t bits =
            static_cast<std::uint32_t>(std::clamp(std::lround(value), 0l, 1023l)) << k % 3 * 10;
        for (int b = 0; b < 4; ++b) {
          if (k % 3 == 0) word[b] = 0;
          word[b] = static_cast<std::uint8_t>(word[b] | bits >> 8 * b);
        }
      }
    return frame;
  }
  const auto put = [&](int plane, int index, int y, double value) {
    std::uint8_t* row = frame.planes[plane].data() + static_cast<std::size_t>(y) * v.strides[plane];
    if (ten) {
      const long word = std::clamp(std::lround(value), 0l, 1023l);
      row[2 * index] = static_cast<std::uint8_t>(word & 255);
      row[2 * index + 1] = static_cast<std::uint8_t>(word >> 8);
    } else {
      row[index] = byte(value);
    }
  };
  const int bytes = ten ? 2 : 1;
  allocate(0, width * bytes, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) put(0, x, y, luma(x, y));
  const bool pairs = format == FrameFormat::nv12;
  allocate(1, (pairs ? 2 : 1) * cw * bytes, ch);
  if (!pairs) allocate(2, cw * bytes, ch);
  for (int j = 0; j < ch; ++j)
    for (int i = 0; i < cw; ++i) {
      put(1, pairs ? 2 * i : i, j, chroma(i, j, 0));
      put(pairs ? 1 : 2, pairs ? 2 * i + 1 : i, j, chroma(i, j, 1));
    }
  return frame;
}

/// But mosaics, of which no pixel has all its colour.
inline constexpr std::array all_formats = {
    FrameFormat::rgbx, FrameFormat::bgrx, FrameFormat::rgba,      FrameFormat::bgra,
    FrameFormat::rgb,  FrameFormat::bgr,  FrameFormat::i420,      FrameFormat::nv12,
    FrameFormat::yuy2, FrameFormat::uyvy, FrameFormat::i420_10le, FrameFormat::v210};

}  // namespace polyhull::test
