// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One picture turned into another, as a switcher's mix does it.
#pragma once

#include <cstdint>

#include "render/frame.h"

namespace polyhull {

/// \p picture becomes \p share (0..1) of itself and the rest of \p other, in codes: both RGBA, rows
/// \p stride and \p other_stride bytes apart. Straight colours weigh as much as their alpha;
/// AlphaCoding::ignored mixes alpha as a channel of its own. Where both are the same, so is the result.
void dissolve(std::uint8_t* picture, int stride, const std::uint8_t* other, int other_stride,
              int width, int height, float share, AlphaCoding alpha);

}  // namespace polyhull
