// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What polyhull-calibrate wand reads.
#pragma once

#include "calibrate/input.h"
#include "studio/calibration/find_light.h"
#include "studio/calibration/wand.h"

namespace polyhull::calibrate_tool {

/// How many pictures of one camera could not be used, and why.
struct LightCounts {
  std::size_t used = 0, dark = 0, several = 0, too_large = 0, too_bright = 0;
};

/// Looks for \p lights (1, or a wand's 2) in all pictures. The instants are those of the pictures;
/// with two lights "NAME a" (the brighter) and "NAME b". \p counts: per camera. Throws Error naming
/// the file, for pictures that cannot be read or are not of their camera's size.
calibration::Take find_light_views(const Pictures& pictures, int lights,
                                   std::vector<LightCounts>* counts,
                                   const calibration::Progress& progress);

/// Adds the detections in a text file, lines of "POINT CAMERA U V" (commas count as blanks, '#'
/// begins a comment), to \p take. New cameras get \p width and \p height. Throws Error naming the
/// line: not of that form, not finite, or a point twice in one camera.
void read_detections(const std::string& path, int width, int height, calibration::Take& take);

}  // namespace polyhull::calibrate_tool
