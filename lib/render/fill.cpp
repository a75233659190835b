// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/fill.h"

#include <algorithm>
#include <cmath>

namespace polyhull {
namespace {

constexpr float middle = fill_greys[1];

float channel(std::uint32_t pixel, int c) {
  return static_cast<float>(pixel >> (8 * c) & 255);
}

/// The least key with which a fill of 0..255 makes \p code of the middle grey, as a code.
float least_key(std::uint32_t code) {
  float least = 0.0f;
  for (int c = 0; c < 3; ++c) {
    const float value = channel(code, c);
    least = std::max(
        {least, 255.0f * (1.0f - value / middle), 255.0f * (value - middle) / (255.0f - middle)});
  }
  return std::ceil(least - 1e-3f);
}

/// The key of the ground, 0..1.
float ground_key(const FillPixel& pixel) {
  bool as_it_was = true;
  for (int k = 0; k < 3; ++k) as_it_was = as_it_was && pixel.ground[k] == pixel.over[k];
  if (as_it_was) return channel(pixel.background, 3) / 255.0f;
  if (pixel.ground[0] == pixel.ground[2]) return 1.0f;  // nothing of the picture below is seen
  float rise = 0.0f;
  for (int c = 0; c < 3; ++c) rise += channel(pixel.ground[2], c) - channel(pixel.ground[0], c);
  constexpr float range = 3.0f * (fill_greys[2] - fill_greys[0]);
  const float key = std::clamp(1.0f - rise / range, 0.0f, 1.0f);
  // The slope is rounded; what it says beyond a shadow's key, by which alone black is black, is not.
  constexpr float rounding = 2.5f / 255.0f;
  const float least = least_key(pixel.ground[1]) / 255.0f;
  return least >= key - rounding ? least : key;
}

/// The key of the subject over that.
float subject_key(const FillPixel& pixel) {
  if (pixel.coverage <= 0.0f) return 0.0f;
  if (pixel.coverage >= 1.0f) return 1.0f;
  // Of a subject as grey as the ground no difference tells: its coverage does.
  constexpr float coverage_counts = 16.0f * 16.0f;
  float above = coverage_counts * pixel.coverage, below = coverage_counts;
  for (int c = 0; c < 3; ++c) {
    const float v = channel(pixel.ground[1], c);
    const float own = 255.0f * pixel.colour[c] - v;
    above += own * (channel(pixel.whole, c) - v);
    below += own * own;
  }
  return std::clamp(above / below, 0.0f, 1.0f);
}

}  // namespace

std::uint32_t over_grey(std::uint32_t pixel, int grey, AlphaCoding alpha) {
  const auto a = static_cast<int>(pixel >> 24);
  std::uint32_t out = 0xff000000u;
  for (int c = 0; c < 3; ++c) {
    const auto colour = static_cast<int>(pixel >> (8 * c) & 255);
    const int own = alpha == AlphaCoding::premultiplied ? 255 * colour : a * colour;
    const int sum = std::min((own + (255 - a) * grey + 127) / 255, 255);
    out |= static_cast<std::uint32_t>(sum) << (8 * c);
  }
  return out;
}

std::uint32_t fill_of(const FillPixel& pixel, AlphaCoding alpha) {
  const float wanted = 1.0f - (1.0f - ground_key(pixel)) * (1.0f - subject_key(pixel));
  bool changed = pixel.whole != pixel.over[1];
  for (int k = 0; k < 3; ++k) changed = changed || pixel.ground[k] != pixel.over[k];
  if (!changed && pixel.coverage <= 0.0f) return pixel.background;
  const float key = std::min(std::max(std::round(255.0f * wanted), least_key(pixel.whole)), 255.0f);
  auto out = static_cast<std::uint32_t>(key) << 24;
  if (key == 0.0f) return out;
  for (int c = 0; c < 3; ++c) {
    float part = channel(pixel.whole, c) - (1.0f - key / 255.0f) * middle;
    part = part < 0.5f ? 0.0f : std::min(part, key);  // what is less is rounding: shadows are black
    if (alpha == AlphaCoding::straight) part *= 255.0f / key;
    out |= static_cast<std::uint32_t>(part + 0.5f) << (8 * c);
  }
  return out;
}

bool any_translucent(const std::uint8_t* pixels, std::ptrdiff_t stride, const Rectangle& part) {
  for (int y = part.y; y < part.y + part.height; ++y) {
    const std::uint8_t* row = pixels + y * stride + 4 * static_cast<std::ptrdiff_t>(part.x);
    std::uint8_t all = 255;
    for (int x = 0; x < part.width; ++x) all &= row[4 * static_cast<std::ptrdiff_t>(x) + 3];
    if (all != 255) return true;
  }
  return false;
}

void show_key(std::uint8_t* pixels, std::ptrdiff_t stride, int width, int height) {
  for (int y = 0; y < height; ++y) {
    std::uint8_t* row = pixels + y * stride;
    for (int x = 0; x < width; ++x, row += 4) {
      row[0] = row[1] = row[2] = row[3];
      row[3] = 255;
    }
  }
}

}  // namespace polyhull
