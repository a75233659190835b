// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/sensor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

/// SplitMix64 (Steele, Lea, Flood 2014): neighbouring numbers become unrelated ones.
std::uint64_t mixed(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15u;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
  return value ^ (value >> 31);
}

/// Blurs rows of a tile that goes on as it begins.
void blur_rows(const std::vector<float>& from, std::vector<float>& to, int side,
               const std::vector<float>& weights) {
  const int reach = static_cast<int>(weights.size()) / 2;
  parallel_each(side, 8, 0, [&](int y) {
    for (int x = 0; x < side; ++x) {
      float sum = 0.0f;
      for (int k = -reach; k <= reach; ++k)
        sum += weights[static_cast<std::size_t>(k + reach)] *
               from[static_cast<std::size_t>(y * side + ((x + k) & (side - 1)))];
      to[static_cast<std::size_t>(x * side + y)] = sum;  // turned: twice is both ways
    }
  });
}

/// Independent numbers of the normal distribution.
std::vector<float> white_noise(std::size_t count) {
  std::mt19937_64 random(20260101);
  std::vector<float> noise(count);
  // By hand: std::normal_distribution differs from library to library.
  for (float& value : noise) {
    const double u = (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53;
    const double v = static_cast<double>(random() >> 11) * 0x1p-53;
    value =
        static_cast<float>(std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * 3.14159265358979 * v));
  }
  return noise;
}

}  // namespace

void Sensor::make_tile(double size) {
  if (size == tile_size_) return;
  constexpr auto count = static_cast<std::size_t>(side) * side;
  if (white_.empty()) white_ = white_noise(count);
  std::vector<float> noise(count), turned(count);
  // The autocorrelation of noise blurred with sigma is a Gaussian of sqrt(2) sigma.
  const double sigma = size / (2.0 * std::sqrt(2.0 * std::log(2.0)) * std::sqrt(2.0));
  const int reach = std::min(static_cast<int>(std::ceil(4.0 * sigma)), side / 2 - 1);
  std::vector<float> weights;
  for (int k = -reach; k <= reach; ++k)
    weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
  blur_rows(white_, turned, side, weights);
  blur_rows(turned, noise, side, weights);
  double mean = 0.0, square = 0.0;
  for (const float value : noise) mean += value / static_cast<double>(count);
  for (const float value : noise)
    square += (value - mean) * (value - mean) / static_cast<double>(count);
  tile_.resize(2 * count);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < 2 * side; ++x)
      tile_[static_cast<std::size_t>(y) * 2 * side + static_cast<std::size_t>(x)] =
          static_cast<float>((noise[static_cast<std::size_t>(y * side + (x & (side - 1)))] - mean) /
                             std::sqrt(square));
  tile_size_ = size;
}

void Sensor::fall_off(const ViewportLens& lens, const Camera& viewport, int y,
                      std::uint8_t* row) const {
  const float* linear = srgb_to_linear_table();
  const std::uint8_t* codes = linear_to_srgb_table();
  const auto fx = static_cast<float>(1.0 / viewport.K[0][0]);
  const auto down = static_cast<float>((y - viewport.K[2][1]) / viewport.K[1][1]);
  const auto middle = static_cast<float>(viewport.K[2][0] + viewport.K[1][0] * down);
  const auto a1 = static_cast<float>(lens.falloff[0]), a2 = static_cast<float>(lens.falloff[1]),
             a3 = static_cast<float>(lens.falloff[2]);
  for (int x = 0; x < viewport.width; ++x) {
    const float across = (static_cast<float>(x) - middle) * fx;
    const float s = across * across + down * down;
    const float gain = 1.0f + s * (a1 + s * (a2 + s * a3));
    for (int c = 0; c < 3; ++c)
      row[4 * x + c] = linear_to_srgb(gain * linear[row[4 * x + c]], codes);
  }
}

void Sensor::add_grain(std::uint64_t frame, int width, int y, float scale,
                       std::uint8_t* row) const {
  constexpr unsigned mask = side - 1;
  for (unsigned c = 0; c < 3; ++c) {
    const std::uint64_t place = mixed(mixed(frame) + c);
    const unsigned down = (static_cast<unsigned>(place) + static_cast<unsigned>(y)) & mask;
    const auto first = static_cast<unsigned>(place >> 32);
    const float* noise = &tile_[static_cast<std::size_t>(down) * 2 * side];
    for (int begin = 0; begin < width; begin += side) {
      const float* from = noise + ((first + static_cast<unsigned>(begin)) & mask);
      std::uint8_t* to = row + 4 * begin + c;
      const int count = std::min(side, width - begin);
      for (int i = 0; i < count; ++i) {
        const float value = static_cast<float>(to[4 * i]) + scale * from[i] + 0.5f;
        to[4 * i] = static_cast<std::uint8_t>(value <= 0.0f     ? 0.0f
                                              : value >= 255.0f ? 255.0f
                                                                : value);
      }
    }
  }
}

void Sensor::finish(const ViewportLens& lens, const Camera& viewport, std::uint64_t frame,
                    std::uint8_t* pixels, int stride) {
  const bool falls = lens.falloff != ViewportLens{}.falloff, grains = lens.grain > 0.0;
  if (grains) make_tile(std::max(lens.grain_size, 1.0));
  if (!falls && !grains) return;
  const auto scale = static_cast<float>(255.0 * lens.grain);
  parallel_each(viewport.height, 16, 0, [&](int y) {
    std::uint8_t* row = pixels + static_cast<std::ptrdiff_t>(y) * stride;
    if (falls) fall_off(lens, viewport, y, row);
    if (grains) add_grain(frame, viewport.width, y, scale, row);
  });
}

}  // namespace polyhull
