// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The coloured pixels of the views in a take.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/view.h"
#include "wire/pixel_coding.h"

namespace polyhull::benchmark {

struct Frame {
  PixelShape shape;
  int left = 0, top = 0;             ///< of the region of interest in the camera's picture
  std::vector<std::uint8_t> pixels;  ///< RGBA, rows without gaps
};

/// The views with colours of all streams of the take at \p path. Throws Error where it cannot be read.
std::vector<Frame> read_frames(const char* path);

}  // namespace polyhull::benchmark
