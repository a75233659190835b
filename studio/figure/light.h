// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The studio's light and the codes of what it shows; inline, for they are asked for per pixel.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "base/srgb.h"
#include "base/vector.h"

namespace polyhull {

/// Light of the studio at a matt surface with \p normal (unit length), 0..1: soft from all sides,
/// more from above and from the front left.
inline float studio_light(const Vec3f& normal) {
  static const Vec3f key = glm::normalize(Vec3f(0.45f, 0.65f, 0.60f));
  return 0.66f + 0.13f * normal.y + 0.26f * std::max(glm::dot(normal, key), 0.0f);
}

/// The steps of srgb_codes() from 0 to 1.
inline constexpr int srgb_code_steps = 4096;

/// sRGB codes (0..1) over the square root of the linear value, where the curve is almost straight.
inline const float* srgb_codes() {
  static const auto table = [] {
    std::array<float, srgb_code_steps + 2> t;
    for (int i = 0; i < srgb_code_steps + 2; ++i) {
      const float root = static_cast<float>(i) / srgb_code_steps;
      t[i] = srgb_encoded(root * root);
    }
    return t;
  }();
  return table.data();
}

/// sRGB code (0..1) of a linear value (clamped to 0..1), from a table.
inline float srgb_from_linear(float linear) {
  // Also right for what is not a number.
  const float s = (linear > 0.0f ? std::sqrt(std::min(linear, 1.0f)) : 0.0f) * srgb_code_steps;
  const int i = static_cast<int>(s);
  const float* table = srgb_codes();
  return table[i] + (table[i + 1] - table[i]) * (s - static_cast<float>(i));
}

inline Vec3f srgb_from_linear(const Vec3f& linear) {
  return {srgb_from_linear(linear.x), srgb_from_linear(linear.y), srgb_from_linear(linear.z)};
}

}  // namespace polyhull
