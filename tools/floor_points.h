// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Points of a floor as pictures show them.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

/// Points of the floor from a text file: lines of "POINT CAMERA U V" (a name for the point, the
/// camera, the pixel; names may have blanks), in the order of the points' first lines. '#' begins a comment. Throws Error
/// naming the line.
std::vector<Vec3> read_floor_points(const std::string& path, const Rig& rig);

}  // namespace polyhull
