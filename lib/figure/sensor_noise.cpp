// SPDX-License-Identifier: LGPL-2.1-or-later
#include "figure/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace polyhull {
namespace {

// Rows start at random places of one long table, so a table entry turns up about every ten rows,
// each time beside other neighbours from other rows.
constexpr std::size_t table_pixels = 1 << 16;
constexpr std::size_t piece = 256;  // pixels that are read in one go

}  // namespace

std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

void SensorNoise::prepare(double deviation) {
  if (deviation == deviation_) return;
  deviation_ = deviation;
  table_.assign(4 * (table_pixels + piece), 0);
  const auto uniform = [](std::uint64_t i) {
    return (static_cast<double>(mix_bits(i) >> 11) + 0.5) * 0x1p-53;
  };
  std::uint64_t counter = 0;
  for (std::size_t i = 0; i < table_.size(); ++i) {
    if (i % 4 == 3) continue;
    const double radius = std::sqrt(-2.0 * std::log(uniform(counter++)));
    const double value = deviation * radius * std::cos(2.0 * std::numbers::pi * uniform(counter++));
    table_[i] = static_cast<std::int8_t>(std::clamp(std::lround(value), -127L, 127L));
  }
}

void SensorNoise::add(double deviation, std::uint64_t key, std::uint8_t* pixels,
                      std::size_t count) const {
  if (deviation <= 0.0) return;
  for (std::size_t first = 0; first < count; first += piece) {
    const std::size_t n = 4 * std::min(piece, count - first);
    const std::int8_t* noise = table_.data() + 4 * (mix_bits(key + first) % table_pixels);
    std::uint8_t* p = pixels + 4 * first;
    for (std::size_t i = 0; i < n; ++i) {
      const auto sum = static_cast<std::int16_t>(p[i] + noise[i]);
      p[i] = static_cast<std::uint8_t>(std::clamp<std::int16_t>(sum, 0, 255));
    }
  }
}

}  // namespace polyhull
