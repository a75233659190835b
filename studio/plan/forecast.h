// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What to expect of a rig: the figure on its stage, simulated.
#pragma once

#include <string>
#include <vector>

#include "studio/plan/stage.h"

namespace polyhull {

/// Means over the places of the stage where all cameras have the figure whole in their pictures.
struct Forecast {
  int places = 0;  ///< of stage_bodies(); 0: nothing could be simulated, the rest is 0 but for cut
  int all_places = 0;
  double spread = 0.0;     ///< how far to the stage's corners they reach, spread_for()
  std::vector<int> cut;    ///< per camera: at how many places its picture does not hold the figure
  double hull_mean = 0.0;  ///< mm from the figure, the mean of both directions' means
  double refined_mean = 0.0;  ///< the same of the refined surface
  double refined_p95 = 0.0;   ///< mm; 95 % are nearer, of both directions the larger
  /// Of the silhouettes half way between neighbouring cameras: both over either.
  double overlap = 0.0;
  double unseen = 0.0;  ///< SightError::unseen of all cameras
  /// Shares of the figure's surface that no, one, and two or more cameras see at more than 15
  /// degrees.
  double seen_by[3] = {0.0, 0.0, 0.0};
  double stage_share = 0.0;  ///< of the stage's volume that all cameras see
};

/// \p cameras in the stage's coordinates (staged_rig()), two or more. The same for any number of
/// threads. Throws Error as stage_bodies() does.
Forecast forecast_of(const std::vector<Camera>& cameras, const Stage& stage);

/// The forecast in words, some lines.
std::string text_of(const Forecast& forecast, const std::vector<Camera>& cameras);

/// One line for each camera: where it stands, where it looks (pan and tilt), how sharp, and by how many
/// degrees it fails to face the camera that it faces most; and one that says what angles count from.
std::string table_of(const std::vector<Camera>& cameras, const Stage& stage);

}  // namespace polyhull
