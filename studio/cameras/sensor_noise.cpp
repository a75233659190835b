// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/sensor_noise.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace polyhull {
namespace {

// Rows start at random places of one long table, so a table entry turns up about every ten rows,
// each time beside other neighbours from other rows.
constexpr std::size_t table_pixels = 1 << 16;
constexpr std::size_t piece = 256;  // pixels that are read in one go

using Table = std::vector<std::int8_t>;  // four values per pixel, alpha's 0

Table make_table(double deviation) {
  Table table(4 * (table_pixels + piece), 0);
  const auto uniform = [](std::uint64_t i) {
    return (static_cast<double>(mix_bits(i) >> 11) + 0.5) * 0x1p-53;
  };
  std::uint64_t counter = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (i % 4 == 3) continue;
    const double radius = std::sqrt(-2.0 * std::log(uniform(counter++)));
    const double value = deviation * radius * std::cos(2.0 * std::numbers::pi * uniform(counter++));
    table[i] = static_cast<std::int8_t>(std::clamp(std::lround(value), -127L, 127L));
  }
  return table;
}

}  // namespace

std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

void SensorNoise::prepare(double deviation) {
  if (deviation == deviation_) return;
  // The table says nothing about the camera: those of a process share it.
  static std::mutex mutex;
  static std::weak_ptr<const Table> last;
  static double last_deviation = -1.0;
  const std::lock_guard lock(mutex);
  table_ = deviation == last_deviation ? last.lock() : nullptr;
  if (!table_) table_ = std::make_shared<const Table>(make_table(deviation));
  last = table_;
  last_deviation = deviation_ = deviation;
}

void SensorNoise::add(double deviation, std::uint64_t key, std::uint8_t* pixels,
                      std::size_t count) const {
  if (deviation <= 0.0) return;
  for (std::size_t first = 0; first < count; first += piece) {
    const std::size_t n = 4 * std::min(piece, count - first);
    const std::int8_t* noise = table_->data() + 4 * (mix_bits(key + first) % table_pixels);
    std::uint8_t* p = pixels + 4 * first;
    std::size_t i = 0;
#ifdef __SSE2__
    // Saturating addition is there for signed bytes: grey 128 becomes 0.
    const __m128i turn = _mm_set1_epi8(-128);
    for (; i + 16 <= n; i += 16) {
      auto* at = reinterpret_cast<__m128i*>(p + i);
      const __m128i add = _mm_loadu_si128(reinterpret_cast<const __m128i*>(noise + i));
      const __m128i sum = _mm_adds_epi8(_mm_xor_si128(_mm_loadu_si128(at), turn), add);
      _mm_storeu_si128(at, _mm_xor_si128(sum, turn));
    }
#endif
    for (; i < n; ++i) p[i] = static_cast<std::uint8_t>(std::clamp(p[i] + noise[i], 0, 255));
  }
}

}  // namespace polyhull
