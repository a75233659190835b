// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From views of a board to a rig, and whether it is a good one.
#pragma once

#include "rig/rig.h"
#include "studio/calibration/adjust.h"

namespace polyhull::calibration {

/// The world's frame. Without a floor it is the first camera's, moved to metres and y up.
struct Floor {
  /// The instant at which the board lies on the floor, face up: its middle is the origin, y points
  /// up, x along its columns.
  std::optional<std::size_t> view;
  double thickness = 0.0;  ///< the face's height above the floor, m

  /// Else three points of the floor or more, in the first camera's frame (see rig/floor.h): the
  /// first is the origin, x points to the second.
  std::vector<Vec3> points;
};

struct Settings {
  LensModel model = LensModel::five;
  Progress progress = [](const std::string&, double) {};
};

/// What a calibration must be to count as good.
struct Bar {
  double rms = 1.0;        ///< px, of each camera
  double centre = 0.0025;  ///< standard deviation of the centre, as a part of the boards' distance
  double focal = 0.005;    ///< standard deviation of the focal length, as a part of it
  double left_out = 0.1;   ///< share of a camera's views that did not fit
  std::size_t views = 10;  ///< of each camera whose lens is estimated
  double coverage = 0.4;   ///< share of the picture in which corners were seen; for lenses only
};

/// One camera's part of the result.
struct CameraFit {
  std::size_t views = 0;      ///< that took part
  std::size_t left_out = 0;   ///< that did not fit
  double rms = 0.0;           ///< root mean square distance of its corners, px
  double coverage = 0.0;      ///< share of 16x9 cells of the picture with a corner in or beside it
  double distance = 0.0;      ///< median distance of the boards, m
  double centre_sigma = 0.0;  ///< m: root of the covariance's trace
  double rotation_sigma = 0.0;  ///< degrees, the same
};

struct Calibration {
  Take take;  ///< with the corners' numbers as they were used
  Adjusted adjusted;
  std::vector<CameraFit> cameras;
  Rig rig;

  /// What is not good about it, a sentence each; empty: all is.
  std::vector<std::string> faults(const Bar& bar) const;
};

/// Calibrates the cameras of \p take in the frame of the first one; move_to_floor() changes that.
/// The same for any number of threads. Throws Error (bad_input) as check_take(), start_lens(),
/// place_cameras() and adjust() do.
Calibration calibrate(Take take, const Settings& settings);

/// What \p adjusted says of \p take, in the frame of \p adjusted.
Calibration calibration_of(Take take, Adjusted adjusted);

/// To the world in which \p board, which stands at \p pose, lies face up on the floor y = 0, its face \p
/// thickness above it: its middle is above the origin, x points along its columns.
Pose floor_of_board(const Board& board, const Pose& pose, double thickness);

/// Moves the world to \p floor. Throws Error (bad_input) where no view of that instant took part,
/// or where points lie on a line.
void move_to_floor(Calibration& calibration, const Floor& floor);

}  // namespace polyhull::calibration
