// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where cameras really stand, from silhouettes of whoever walks between them.
///
/// Each pair of cameras has two frontier points in each instant (hull/repair/tangency.h), one point of
/// space that both outlines show. With the rays d_a, d_b of its pictures p_a, p_b and the vector e
/// from one centre to the other,
///
///     E = e·(d_a x d_b) = 0,     residual = sqrt(2) E / |(dE/dp_a, dE/dp_b)|
///
/// (Sampson's distance, in pixels of one camera), whose squares are made least over the poses. Which
/// points are frontier points depends on the poses, in second order only: they are found anew until
/// nothing moves (Furukawa, Sethi, Ponce and Kriegman 2006, "Robust structure and motion from outlines
/// of smooth curved surfaces"). Outlines say nothing of where the whole rig stands and how large it
/// is: weak ties to the given poses do, which a camera that is far off breaks.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/rings.h"
#include "rig/rig.h"

namespace polyhull::calibration {

/// One instant: by camera of the rig its silhouette in real pixels, distortion and all; empty: unknown.
using OutlineInstant = std::vector<Rings>;

struct OutlinePoses {
  Rig rig;                                       ///< the given one with the poses that were found
  std::size_t tangencies = 0;                    ///< that went in
  double error_before = 0.0, error_after = 0.0;  ///< px, median of their magnitudes
  /// By camera: the root mean square over its pairs of the pairs' medians, px (see median_by_pair()).
  std::vector<double> camera_before, camera_after;
};

/// The poses of \p rig that fit \p instants. \p free: the numbers of the cameras that may move; the
/// others stand. Throws Error where there are fewer frontier points than would hold the poses (three
/// for each of a camera's six parameters), naming the camera.
OutlinePoses poses_from_outlines(const Rig& rig, std::span<const OutlineInstant> instants,
                                 const std::vector<std::size_t>& free);

}  // namespace polyhull::calibration
