// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A bright light in a dark picture.
#pragma once

#include <vector>

#include "base/picture.h"
#include "base/vector.h"

namespace polyhull::calibration {

/// Why a picture shows no light that can be used.
enum class LightFault { none, dark, several, too_large, too_bright };

struct Lights {
  LightFault fault = LightFault::none;
  std::vector<Vec2> places;  ///< pixels; brightest first; as many as asked for, or none
};

/// The middles (weighted by brightness above the background's) of the \p count lights in \p grey, one
/// channel: what is brighter than half way between background (the median) and the brightest pixel.
/// dark: nothing, or fewer than \p count, stands out by 40 levels of 255; several: more than \p count;
/// too_large: one covers more than a 200th of the picture; too_bright: a 20th of the picture is
/// saturated.
Lights find_lights(const Picture& grey, int count);

}  // namespace polyhull::calibration
