// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Bundle adjustment (B. Triggs et al., "Bundle adjustment: a modern synthesis", 1999): lenses and
/// poses of all cameras and of the board at all instants at once, so that the squared distances of
/// all corners in all pictures become least. Ceres does the work. Huber's loss holds what does not
/// fit at bay until it is found and left out; the last round has plain squares.
#pragma once

#include <functional>

#include "studio/calibration/links.h"

namespace polyhull::calibration {

/// How sure a camera's numbers are: standard deviations by the adjustment's covariances, for the
/// noise that the residuals show. Poses are told against the rig as a whole: of all frames the one
/// in which the cameras' errors are least together. Infinite where the views do not determine them,
/// 0 where they were given.
struct Uncertainty {
  Mat3 centre{0.0};              ///< covariance of the centre, world axes, m^2
  Mat3 rotation{0.0};            ///< covariance of the rotation vector, world axes, radians^2
  std::array<double, 9> lens{};  ///< of fx fy cx cy (px), k1 k2 p1 p2 k3

  /// From measurements of deviation 1 to those of \p noise.
  void scale(double noise) {
    centre *= noise * noise;
    rotation *= noise * noise;
    for (double& sigma : lens) sigma *= noise;
  }
};

/// How a view fits.
struct ViewFit {
  double rms = 0.0;             ///< root mean square distance of its corners, px
  bool used = true;             ///< whether it took part
  std::vector<Vec2> residuals;  ///< per corner: where the model has it, less where it was seen, px
  std::vector<bool> corner_used;
};

struct Adjusted {
  std::vector<Camera> cameras;
  std::vector<Pose> boards;  ///< per instant
  std::vector<ViewFit> views;
  std::vector<Uncertainty> uncertainties;
  double rms = 0.0;    ///< root mean square distance of all corners used, px
  double noise = 0.0;  ///< standard deviation of one coordinate of a corner, px
};

/// Says how far the work is: what is done, and which part of it (0 to 1).
using Progress = std::function<void(const std::string& what, double part)>;

/// Distortion coefficients that \p model leaves out stay 0. Throws Error (bad_input) naming a
/// camera none of whose views fits the others.
Adjusted adjust(const Take& take, const std::vector<LensStart>& starts, const Placement& placement,
                LensModel model, const Progress& progress);

}  // namespace polyhull::calibration
