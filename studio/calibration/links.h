// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From cameras that each know where the board stood to cameras in one frame.
///
/// Two cameras that see the board at one instant stand to each other as that view says. Of all
/// their shared instants that one is taken which explains the others best (the least median of the
/// distances, P. J. Rousseeuw, "Least median of squares regression", JASA 1984), so that up to half
/// of the views may be wrong. The best pairs that reach all cameras, a minimum spanning tree
/// (R. C. Prim, 1957), place them.
#pragma once

#include "studio/calibration/lens_start.h"

namespace polyhull::calibration {

/// All cameras and boards in the frame of one camera: where the adjustment starts.
struct Placement {
  std::vector<Pose> cameras;  ///< from the world to each camera
  std::vector<Pose> boards;   ///< per instant: from the board to the world
  std::size_t first = 0;      ///< the camera whose frame the world is
};

/// view_error(), the lesser of both ways round where the board looks the same turned; \p turned
/// says which.
double either_error(const Board& board, const View& view, const Camera& camera, const Pose& pose,
                    bool* turned);

/// Distances above this, px, are no noise but a contradiction: 2 % of the picture's diagonal.
double contradiction_limit(const Camera& camera);

/// \p take: of a board that looks the same turned, the views' numbers are turned so that all cameras
/// mean the same corners. \p starts: per camera, its poses in the order of the take's views of it.
/// Throws Error (bad_input), naming the cameras: views that leave a camera unconnected, that
/// contradict each other, and pictures that are mirrored.
Placement place_cameras(Take& take, const std::vector<LensStart>& starts);

}  // namespace polyhull::calibration
