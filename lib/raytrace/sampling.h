// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Sample points for light transport, all computed from whole numbers: the same on every run and on
/// any number of threads.
///
/// Points are the first two dimensions of Sobol's sequence with nested uniform (Owen) scrambling in
/// the hashed form of Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020: each power
/// of two of points is a (0, m, 2)-net, and sequences with different seeds are independent.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "base/vector.h"

namespace polyhull {

/// A well mixed function of its argument, or of both.
inline std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  return x ^ (x >> 16);
}

inline std::uint32_t hash(std::uint32_t a, std::uint32_t b) {
  return hash(a + 0x9e3779b9U + hash(b));
}

inline std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffU) << 8) | ((x & 0xff00ff00U) >> 8);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x & 0xf0f0f0f0U) >> 4);
  x = ((x & 0x33333333U) << 2) | ((x & 0xccccccccU) >> 2);
  return ((x & 0x55555555U) << 1) | ((x & 0xaaaaaaaaU) >> 1);
}

/// Owen scrambling of a number whose bits are in reversed order.
inline std::uint32_t scramble_reversed(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return x;
}

/// Owen scrambling of a number, \p seed choosing which.
inline std::uint32_t owen_scramble(std::uint32_t x, std::uint32_t seed) {
  return reverse_bits(scramble_reversed(reverse_bits(x), seed));
}

/// Second dimension of Sobol's sequence (the first is the reversed index).
inline std::uint32_t sobol_second(std::uint32_t index) {
  std::uint32_t value = 0;
  for (std::uint32_t direction = 0x80000000U; index; index >>= 1, direction ^= direction >> 1)
    if (index & 1U) value ^= direction;
  return value;
}

/// Point \p index of the sequence \p seed, in [0, 1)^2.
inline Vec2f sample_point(std::uint32_t index, std::uint32_t seed) {
  // Shuffling the index decorrelates this pair of dimensions from the other pairs of a path.
  const std::uint32_t i = owen_scramble(index, hash(seed, 0x51633e2dU));
  const std::uint32_t x = owen_scramble(reverse_bits(i), hash(seed, 0x68bc21ebU));
  const std::uint32_t y = owen_scramble(sobol_second(i), hash(seed, 0x02e5be93U));
  return {static_cast<float>(x >> 8) * 0x1p-24f, static_cast<float>(y >> 8) * 0x1p-24f};
}

/// Two directions that complete the unit vector \p n to a right-handed frame (Duff et al.,
/// "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017).
inline std::array<Vec3f, 2> tangents(const Vec3f& n) {
  const float sign = std::copysign(1.0f, n.z);
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {Vec3f(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x),
          Vec3f(b, sign + n.y * n.y * a, -n.y)};
}

/// A direction around +z with density cos / pi, from a point of the unit square.
inline Vec3f cosine_direction(const Vec2f& square) {
  // Shirley and Chiu's map of the square to the disk keeps the points' stratification.
  const float a = 2.0f * square.x - 1.0f, b = 2.0f * square.y - 1.0f;
  if (a == 0.0f && b == 0.0f) return {0.0f, 0.0f, 1.0f};
  constexpr float quarter = std::numbers::pi_v<float> / 4.0f;
  const bool wide = std::abs(a) > std::abs(b);
  const float r = wide ? a : b;
  const float angle = wide ? quarter * (b / a) : 2.0f * quarter - quarter * (a / b);
  const float x = r * std::cos(angle), y = r * std::sin(angle);
  return {x, y, std::sqrt(std::max(0.0f, 1.0f - x * x - y * y))};
}

}  // namespace polyhull
