// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Between linear light (0 = black, 1 = white of the picture) and sRGB (IEC 61966-2-1).
#pragma once

#include <cmath>
#include <cstdint>

#include "base/vector.h"

namespace polyhull {

/// By which red, green and blue of linear light make its luminance (Rec. 709, whose primaries sRGB has).
template <class T>
inline constexpr glm::vec<3, T> luminance_weights{T(0.2126), T(0.7152), T(0.0722)};

/// The linear value of the code \p encoded, 0..1 as floating point.
template <class T>
T srgb_decoded(T encoded) {
  return encoded <= T(0.04045) ? encoded / T(12.92)
                               : std::pow((encoded + T(0.055)) / T(1.055), T(2.4));
}

template <class T>
glm::vec<3, T> srgb_decoded(const glm::vec<3, T>& encoded) {
  return {srgb_decoded(encoded.x), srgb_decoded(encoded.y), srgb_decoded(encoded.z)};
}

/// The code of \p linear, both 0..1.
template <class T>
T srgb_encoded(T linear) {
  return linear <= T(0.0031308) ? T(12.92) * linear
                                : T(1.055) * std::pow(linear, 1 / T(2.4)) - T(0.055);
}

/// The linear value of the byte \p value, from a table.
float srgb_to_linear(std::uint8_t value);

/// The 256 values of srgb_to_linear().
const float* srgb_to_linear_table();

inline constexpr int srgb_encode_steps = 65536;

/// The nearest bytes of i / srgb_encode_steps, i from 0 to srgb_encode_steps.
const std::uint8_t* linear_to_srgb_table();

/// The nearest byte of \p linear, clipped to 0..1; 0 for NaN; from linear_to_srgb_table(), which
/// loops over many pixels look up but once.
inline std::uint8_t linear_to_srgb(float linear, const std::uint8_t* table) {
  const float within = linear > 0.0f ? (linear < 1.0f ? linear : 1.0f) : 0.0f;
  return table[static_cast<int>(within * srgb_encode_steps + 0.5f)];
}
std::uint8_t linear_to_srgb(float linear);

}  // namespace polyhull
