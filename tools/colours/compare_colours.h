// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig colours: how far the cameras' colours lie apart on a colour checker, and the matrix
/// that would bring each to the reference.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

struct ColourArguments {
  std::vector<std::string> pictures;  ///< CAMERA=FILE: each camera's picture of the chart
  /// CAMERA=X,Y,X,Y,X,Y,X,Y: the outer corners of the patches dark skin, bluish green, black and
  /// white in its picture, pixels
  std::vector<std::string> corners;
  std::string reference = "mean";  ///< "mean", "chart" (published values) or a camera's name
};

/// A table of the cameras, in text: delta E00 (CIEDE2000) to the reference on average and at worst,
/// as seen and after the camera's matrix, and the matrix, linear light. Patches that are clipped in
/// any camera are left out and named on standard error. Throws Error for an unknown camera or
/// reference, a camera without corners or picture, one of another size than the rig says, corners
/// that cannot be a chart's, and fewer than six patches left.
std::string compare_colours(const Rig& rig, const ColourArguments& arguments);

}  // namespace polyhull
