// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures of radiance, from Radiance's .hdr files (RGBE: Ward, "Real Pixels", Graphics Gems II, 1991)
/// or from PNG and JPEG files.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/vector.h"

namespace polyhull {

/// Rows of linear values from the top, without padding.
struct RadiancePicture {
  int width = 0;
  int height = 0;
  std::vector<Vec3f> pixels;
};

/// Reads the file at \p path, told apart by its content; of PNG and JPEG files white is radiance 1. Throws Error
/// where there is none, where it is cut off or broken, larger than 16384x8192 pixels, or not RGB.
RadiancePicture load_radiance(const std::string& path);

}  // namespace polyhull
