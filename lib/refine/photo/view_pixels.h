// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A camera's picture, as photo consistency asks it.
#pragma once

#include <cstdint>

#include "base/vector.h"

namespace polyhull {

/// What a camera's picture shows of a part of its frame, real pixels; borrowed.
struct ViewPixels {
  const std::uint8_t* pixels = nullptr;  ///< null: no picture
  int stride = 0;                        ///< bytes from row to row
  int channels = 4;                      ///< red, green, blue first; fewer than 3: grey first
  Rectangle roi;                         ///< what the pixels are of
};

}  // namespace polyhull
