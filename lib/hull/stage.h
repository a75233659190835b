// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The whole hull stage, from contours as the cameras saw them to a hull whose faces know their
/// contour edges: undistorted (rig/undistort.h), intersected (hull/hull.h), welded (hull/weld.h).
/// Keeps from set to set what can be reused.
#pragma once

#include <map>
#include <span>
#include <string>

#include "hull/hull.h"
#include "rig/undistort.h"

namespace polyhull {

/// What one camera saw: contours in real (distorted) pixels.
struct CameraContours {
  const Camera* camera = nullptr;
  const Rings* rings = nullptr;
};

/// One object per stream; not for use by two threads at once.
class HullStage {
 public:
  /// The hull of \p views, each of another camera name, which stands for the same calibration in
  /// all calls; HullFace::view indexes them, HullFace::edge their rings' points. Fewer than two
  /// views with a foreground have an empty hull: one cone never closes. \p weld_distance: world
  /// units, see weld_vertices(). Valid until the next call. Throws Error as HullBuilder::build()
  /// does.
  const Hull& build(std::span<const CameraContours> views, const HullOptions& options,
                    double weld_distance);

  /// Of the last call; all zero where no hull was built. The time of undistort_rings() is apart, in
  /// seconds.
  const HullStatistics& statistics() const { return statistics_; }
  double seconds_undistort() const { return seconds_undistort_; }

 private:
  struct Contours {
    Camera camera;
    Rings real;
    UndistortedRings ideal;
  };
  const UndistortedRings& undistorted(const CameraContours& view);

  std::map<std::string, Contours> contours_;
  HullBuilder builder_;
  Hull hull_;
  HullStatistics statistics_;
  double seconds_undistort_ = 0.0;
  bool is_builders_ = false;  // hull_ is the builder's last result, and
  double welded_ = 0.0;       // welded by this distance
};

}  // namespace polyhull
