// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig colours: how far the cameras' colours lie apart on a colour checker or a grey card, and
/// the matrix that brings each to the reference.
#pragma once

#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

struct ColourArguments {
  std::vector<std::string> pictures;  ///< CAMERA=FILE: each camera's picture of the chart or card
  /// CAMERA=X,Y,X,Y,X,Y,X,Y: the outer corners of the patches dark skin, bluish green, black and
  /// white in its picture, pixels
  std::vector<std::string> corners;
  /// CAMERA=LEFT,TOP,RIGHT,BOTTOM: a rectangle within the grey card in its picture, pixels. Either
  /// these or corners.
  std::vector<std::string> grey;
  std::string reference = "mean";  ///< "mean", "chart" (published values; grey) or a camera's name
};

/// A table of the cameras, in text: delta E00 (CIEDE2000) to the reference on average and at worst,
/// as seen and after the camera's matrix, and the matrix, linear light: of a grey card, which has one
/// colour only, a gain for each channel. \p rig's cameras that have a picture get their matrices
/// (Camera::colour). Patches that are clipped in any camera are left out and named on standard error.
/// Throws Error for an unknown camera or reference, a camera without corners (rectangle) or picture,
/// one of another size than the rig says, corners that cannot be a chart's, a card that is clipped, and
/// fewer than six patches left.
std::string match_colours(Rig& rig, const ColourArguments& arguments);

}  // namespace polyhull
