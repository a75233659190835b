// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The floor by a board that lies on it, for polyhull-rig level.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rig/floor.h"
#include "studio/calibration/find_board.h"
#include "studio/calibration/pose.h"

namespace polyhull {

struct PlacedBoard {
  calibration::Pose pose;  ///< from the board to the world
  double rms = 0.0;  ///< root mean square distance of the corners from where cameras see them, px
};

/// Where \p board stands by all \p views of it at one instant, whose cameras count in \p cameras: the
/// pose with the least squared distances of all corners in all pictures (Ceres), from the best of
/// those that each camera tells alone. Lengths, those of the board, too, are in the cameras' unit.
/// Throws Error (bad_input) where no view tells a pose, and where one of them, which it names, is more
/// than 2 % of its picture's diagonal off: another instant, another unit, a rig that is wrong.
PlacedBoard place_board(const calibration::Board& board, std::vector<calibration::View> views,
                        const std::vector<Camera>& cameras);

struct BoardFloor {
  Frame frame;       ///< from the rig's world, in its unit, to the floor's: as --floor-view has it
  std::string text;  ///< what was found, a line each
};

/// The floor under the board \p target (metres), whose face is \p thickness metres above it, as \p
/// pictures (cameras of \p rig by number, files) show it at one instant. Throws Error: pictures that
/// cannot be read or have another size than the rig says, the board in none of them, and as
/// place_board().
BoardFloor floor_by_board(const Rig& rig, const calibration::Target& target, double thickness,
                          const std::vector<std::pair<std::size_t, std::string>>& pictures);

}  // namespace polyhull
