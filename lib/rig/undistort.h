// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Contours from real pixels to pinhole pixels.
#pragma once

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

/// Rings in pinhole pixels, and where each vertex came from.
struct UndistortedRings {
  Rings rings;
  /// Per point: the index (into the original points) of the original edge's first vertex on which
  /// the edge that starts at this point lies.
  std::vector<std::uint32_t> source;
};

/// The rings with every vertex undistorted. A straight edge of a real picture is a curve in the
/// pinhole picture: edges are subdivided until the curve strays from its chords by at most
/// \p max_deviation pinhole pixels (at most 64 pieces an edge). Without distortion the points come
/// back as they are. Vertices outside the model's invertible disk go to its rim (see Lens).
UndistortedRings undistort_rings(const Camera& camera, const Rings& rings,
                                 double max_deviation = 0.05);

}  // namespace polyhull
