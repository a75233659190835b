// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What who holds the board sees: each camera's picture with what it has covered and where it wants
/// the board next.
#pragma once

#include <optional>
#include <vector>

#include "base/picture.h"
#include "studio/calibration/board_guide.h"

namespace polyhull::calibrate_tool {

/// Cameras side by side in an RGB picture of 1280 pixels in width: covered cells green, the board's
/// corners as dots where it was found, a frame around the ninth that is wanted next, a line of words
/// below. \p names, \p pictures (grey; the last ones where there is none now) and \p views by camera.
Picture draw_guide(const calibration::BoardGuide& guide, const std::vector<std::string>& names,
                   const std::vector<Picture>& pictures,
                   const std::vector<std::optional<calibration::View>>& views);

}  // namespace polyhull::calibrate_tool
