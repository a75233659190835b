// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A camera's lens and the boards before it, from the camera's own views: where the adjustment
/// starts. OpenCV's calibrateCamera (after Z. Zhang, "A flexible new technique for camera
/// calibration", PAMI 2000) and solvePnP.
#pragma once

#include "studio/calibration/pose.h"
#include "studio/calibration/take.h"

namespace polyhull::calibration {

/// Which distortion is estimated: nothing, OpenCV's k1 k2 p1 p2, or k1 k2 p1 p2 k3.
enum class LensModel { pinhole = 0, four = 4, five = 5 };

/// One camera alone.
struct LensStart {
  Camera camera;            ///< K and distortion (5 numbers, or those known); R and t are not set
  std::vector<Pose> poses;  ///< per view: from the board to the camera
  std::vector<double> rms;  ///< per view: root mean square distance, px
};

/// Of the \p views of camera \p c of \p take. Views that fit much worse than the others do not take
/// part in the lens. Throws Error (bad_input), naming the camera, where the views do not determine
/// the lens: too few of them left, or all parallel.
LensStart start_lens(const Take& take, std::size_t c, const std::vector<View>& views,
                     LensModel model);

/// The pose of the board in \p view before \p camera (whose R and t do not count), and the distance
/// (root mean square, px) that is left. Throws Error as start_lens().
Pose board_pose(const Board& board, const View& view, const Camera& camera, double* rms);

/// The distances (root mean square, px) of the corners of \p view from where \p camera sees them
/// when the board stands at \p pose before it; infinite where a corner is behind it.
double view_error(const Board& board, const View& view, const Camera& camera, const Pose& pose);

}  // namespace polyhull::calibration
