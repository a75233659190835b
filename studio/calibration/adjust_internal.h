// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The adjustment's numbers, between adjust.cpp and uncertainty.cpp.
#pragma once

#include <ceres/problem.h>

#include "studio/calibration/adjust.h"
#include "studio/calibration/projection.h"

namespace polyhull::calibration {

/// What Ceres changes.
struct Unknowns {
  std::vector<std::array<double, lens_parameters>> lenses;   ///< per camera
  std::vector<std::array<double, pose_parameters>> cameras;  ///< per camera
  std::vector<std::array<double, pose_parameters>> boards;   ///< per instant
};

/// Per camera of \p take; \p first is the camera whose pose the problem holds still. Without the
/// scale of the noise: of a noise of 1 px.
std::vector<Uncertainty> find_uncertainties(const Take& take, ceres::Problem& problem,
                                            const Unknowns& unknowns, std::size_t first);

}  // namespace polyhull::calibration
