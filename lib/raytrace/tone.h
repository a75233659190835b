// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Between linear light (0 = black, 1 = white of the picture) and 8-bit sRGB values.
#pragma once

#include <cstdint>

namespace polyhull {

/// IEC 61966-2-1: the linear value, 0..1, of the sRGB byte \p value.
float srgb_to_linear(std::uint8_t value);

/// The nearest sRGB byte of \p linear, clipped to 0..1; 0 for NaN.
std::uint8_t linear_to_srgb(float linear);

}  // namespace polyhull
