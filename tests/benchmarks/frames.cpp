// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>
#include <random>

#include "base/error.h"
#include "benchmarks/shapes.h"

namespace polyhull::benchmark {
namespace {

struct Plane {
  int width;
  int height;
  std::vector<double> values;
  double at(int x, int y) const {
    return values[static_cast<std::size_t>(std::clamp(y, 0, height - 1)) * width +
                  std::clamp(x, 0, width - 1)];
  }
};

struct Rgb {
  Plane r, g, b;
};

Rgb picture_of(const Matte& matte, double texture) {
  const Plane empty{matte.width, matte.height,
                    std::vector<double>(static_cast<std::size_t>(matte.width) * matte.height)};
  Rgb rgb{empty, empty, empty};
  for (int y = 0; y < matte.height; ++y) {
    for (int x = 0; x < matte.width; ++x) {
      const double a = matte.row(y)[x] / 255.0;
      // Cloth: two slow waves over a skin tone, never green.
      const double wave = texture * (std::sin(x * 0.05) + 0.8 * std::cos(y * 0.07));
      const std::size_t i = static_cast<std::size_t>(y) * matte.width + x;
      rgb.r.values[i] = a * (190 + wave) + (1 - a) * 30;
      rgb.g.values[i] = a * (95 + 0.5 * wave) + (1 - a) * 190;
      rgb.b.values[i] = a * (80 + 0.5 * wave) + (1 - a) * 60;
    }
  }
  return rgb;
}

std::uint8_t byte(double value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

}  // namespace

Frame frame_of(const Matte& matte, FrameFormat format, double noise, unsigned seed,
               double texture) {
  Rgb rgb = picture_of(matte, texture);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, noise);
  if (noise > 0.0) {
    for (Plane* plane : {&rgb.r, &rgb.g, &rgb.b}) {
      for (double& v : plane->values) v = std::clamp(v + normal(random), 0.0, 255.0);
    }
  }
  const int w = matte.width;
  const int h = matte.height;
  Frame frame;
  frame.view.format = format;
  frame.view.width = w;
  frame.view.height = h;
  frame.view.matrix = ColourMatrix::bt709;
  if (format == FrameFormat::bgrx || format == FrameFormat::rgba || format == FrameFormat::rgbx) {
    frame.bytes.resize(static_cast<std::size_t>(w) * h * 4, 255);
    for (std::size_t i = 0; i < rgb.r.values.size(); ++i) {
      const int first = format == FrameFormat::bgrx ? 2 : 0;
      frame.bytes[i * 4 + first] = byte(rgb.r.values[i]);
      frame.bytes[i * 4 + 1] = byte(rgb.g.values[i]);
      frame.bytes[i * 4 + 2 - first] = byte(rgb.b.values[i]);
    }
    frame.view.planes[0] = frame.bytes.data();
    frame.view.strides[0] = w * 4;
    return frame;
  }
  if (format != FrameFormat::nv12 && format != FrameFormat::i420) {
    throw Error(Error::Kind::unsupported, "No such benchmark frame.");
  }
  const auto luma = [&](int x, int y) {
    return 0.2126 * rgb.r.at(x, y) + 0.7152 * rgb.g.at(x, y) + 0.0722 * rgb.b.at(x, y);
  };
  const std::size_t size = static_cast<std::size_t>(w) * h;
  const int cw = (w + 1) / 2;
  const int ch = (h + 1) / 2;
  frame.bytes.resize(size + static_cast<std::size_t>(cw) * ch * 2);
  const bool interleaved = format == FrameFormat::nv12;
  std::uint8_t* const cb = frame.bytes.data() + size;
  std::uint8_t* const cr = interleaved ? cb + 1 : cb + static_cast<std::size_t>(cw) * ch;
  const int step = interleaved ? 2 : 1;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      frame.bytes[static_cast<std::size_t>(y) * w + x] = byte(16 + luma(x, y) * 219 / 255);
    }
  }
  // MPEG-2 siting: on even columns, half way between rows; low-pass 1 2 1 across, 1 1 down.
  for (int y = 0; y < ch; ++y) {
    for (int x = 0; x < cw; ++x) {
      double u = 0.0, v = 0.0;
      for (int j = 0; j < 2; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const int px = 2 * x + i;
          const int py = 2 * y + j;
          const double weight = (i == 0 ? 2.0 : 1.0) / 8.0;
          u += weight * (rgb.b.at(px, py) - luma(std::clamp(px, 0, w - 1), std::min(py, h - 1))) /
               1.8556;
          v += weight * (rgb.r.at(px, py) - luma(std::clamp(px, 0, w - 1), std::min(py, h - 1))) /
               1.5748;
        }
      }
      const std::size_t i = (static_cast<std::size_t>(y) * cw + x) * step;
      cb[i] = byte(128 + u * 224 / 255);
      cr[i] = byte(128 + v * 224 / 255);
    }
  }
  frame.view.planes[0] = frame.bytes.data();
  frame.view.strides[0] = w;
  frame.view.planes[1] = cb;
  frame.view.strides[1] = interleaved ? cw * 2 : cw;
  if (!interleaved) {
    frame.view.planes[2] = cr;
    frame.view.strides[2] = cw;
  }
  return frame;
}

}  // namespace polyhull::benchmark
