// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a real camera's lens, shutter and sensor do to the viewport's picture, apart from its
/// distortion, which is Camera::distortion. Each is off by default. Names and units are those of
/// OpenTrackIO where it has them; places count from the entrance pupil, which is where a Camera's
/// centre is, so that its offset does not come in again.
#pragma once

#include <array>

namespace polyhull {

struct ViewportLens {
  /// Diameter of the entrance pupil, metres: focal length over f-number, 1 at most. 0: a pinhole, all
  /// is sharp.
  double aperture = 0.0;
  double focus_distance = 3.0;  ///< of what is sharp, metres along the optical axis, 1e-3 or above
  bool subject_only = false;    ///< the background's picture has its depth of field already
  /// Share of the time from the frame before to this one in which the shutter is open, 0 to 1: its
  /// angle over 360 degrees. 0: what moves is sharp.
  double shutter = 0.0;
  bool still_background = false;  ///< the background's picture has its motion blur already
  /// OpenTrackIO's exposure fall-off a1 a2 a3: linear light is multiplied by
  /// 1 + a1 r^2 + a2 r^4 + a3 r^6 with r the distance from the principal point over the focal length.
  /// The natural fall-off of an ideal lens, cos^4, is -1.84, 1.81, -.73 within .01 up to r = 1.
  std::array<double, 3> falloff{};
  double grain = 0.0;  ///< standard deviation of each channel's code, as a share of white, 0..1
  double grain_size = 1.0;  ///< pixels, 1 or above: of what belongs together
  bool operator==(const ViewportLens&) const = default;
};

}  // namespace polyhull
