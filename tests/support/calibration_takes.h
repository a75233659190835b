// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Boards before cameras whose calibration is known: views with noise, pictures, and how far a
/// result is from the truth.
#pragma once

#include "base/picture.h"
#include "studio/calibration/calibrate.h"
#include "studio/calibration/find_board.h"

namespace polyhull::calibration {

struct RingSettings {
  int cameras = 8;
  double noise = 0.25;  ///< standard deviation of each coordinate of a corner, px
  int instants = 150;   ///< a camera sees the board in about a third of them
  int near_views = 20;  ///< of each camera, with the board near it
  unsigned seed = 1;
  Board board{9, 6, 0.1};
  int width = 1920;
  int height = 1080;
};

struct TrueTake {
  Take take;
  std::vector<Camera> cameras;
  std::vector<Pose> boards;  ///< per instant: from the board to the world; y is up
};

/// Cameras in a ring of 4 m, with distortion, around a board held in all directions.
TrueTake make_ring(const RingSettings& settings);

/// Adds an instant at which the board lies face up on the floor, y = 0, around the origin.
void add_floor_view(TrueTake& truth, double noise, unsigned seed);

/// Adds an instant at which the board faces the only camera; each \p i puts it elsewhere.
void add_parallel_view(TrueTake& truth, int i, double noise);

/// One camera's errors, in the world of the result.
struct CameraError {
  Vec3 centre{0.0};              ///< m
  Vec3 rotation{0.0};            ///< radians
  std::array<double, 9> lens{};  ///< fx fy cx cy k1 k2 p1 p2 k3
};

/// \p found against \p truth, moved as a whole onto it so that the errors become least (as
/// Uncertainty says).
std::vector<CameraError> errors_of(const std::vector<Camera>& found,
                                   const std::vector<Camera>& truth);

/// The error of \p found in the frame in which it stands.
CameraError error_of(const Camera& found, const Camera& truth);

/// The board's drawing at \p pose before grey, as \p camera sees it. Grey.
Picture render_board(const Picture& drawing, const Board& board, const Pose& pose,
                     const Camera& camera);

}  // namespace polyhull::calibration
