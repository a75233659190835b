// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Calibration by a bright point that is moved through the dark stage (T. Svoboda, D. Martinec,
/// T. Pajdla, "A convenient multicamera self-calibration for virtual environments", Presence 14(4),
/// 2005), for cameras that never see one board together.
///
/// A point is a board with one corner: Take, Calibration and the report are those of boards, a
/// point's pose is its position, its rotation is none.
#pragma once

#include "studio/calibration/calibrate.h"

namespace polyhull::calibration {

/// Bright points cannot tell how large the world is: one known distance, m, does. That of pairs of
/// instants (the two ends of a wand at each place, or two marked places), or that of two cameras.
struct KnownDistance {
  std::vector<std::array<std::size_t, 2>> instants;
  std::optional<std::array<std::size_t, 2>> cameras;
  double metres = 0.0;
};

struct WandSettings {
  LensModel model = LensModel::five;
  double field_of_view = 60.0;  ///< degrees, horizontal: first guess for cameras without known lens
  KnownDistance distance;
  Progress progress = [](const std::string&, double) {};
};

/// Least number of points that a camera shares with others.
constexpr std::size_t least_points = 30;

/// A take without views, of single points.
Take empty_wand_take();

/// Where all cameras and points are, in the first placed camera's frame and an arbitrary length:
/// the best pair by its essential matrix (D. Nistér, PAMI 2004, RANSAC), the others one by one by
/// the points placed so far (perspective n points, RANSAC). \p lenses: K and distortion per camera.
/// Throws Error (bad_input) naming the cameras that share too little with the others.
Placement place_by_points(const Take& take, const std::vector<Camera>& lenses);

/// Positions of all points seen by two of \p cameras or more and, in \p used, which views agree with
/// them within \p limit px: of all pairs of rays that one counts with which most views agree. Points
/// on which no two views agree keep no view. \p placed: cameras that count.
std::vector<Vec3> triangulate_points(const Take& take, const std::vector<Camera>& cameras,
                                     const std::vector<bool>& placed, double limit,
                                     std::vector<bool>* used);

/// Bundle adjustment of cameras, lenses that are not known and points, with views that do not fit
/// left out. \p placement: from place_by_points(). Throws Error (bad_input) where the known distance
/// is not seen, or a camera has too few views that fit.
Adjusted adjust_points(const Take& take, const std::vector<Camera>& lenses, Placement placement,
                       const WandSettings& settings);

/// Calibrates in the frame of the first camera that was placed; the origin and axes are arbitrary
/// until move_to_floor(). Throws Error (bad_input), saying what to do: no known distance, one that
/// is not above 0, fewer than two cameras, fewer than `least_points` points, positions in a plane,
/// pixels that are not finite, and as the functions above do.
Calibration calibrate_wand(Take take, const WandSettings& settings);

}  // namespace polyhull::calibration
