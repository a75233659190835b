// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where a tracked camera stands and how it looks, as one packet of a tracking protocol says it.
///
/// The tracker's world is the one that FreeD and OpenTrackIO share: right-handed, metres, z up; a
/// camera whose angles are all 0 looks along +y, with x to its right.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/vector.h"
#include "rig/camera.h"
#include "track/timecode.h"

namespace polyhull {

struct LensState;

struct TrackedPose {
  std::string
      source;  ///< who sends: "freed 3", or an OpenTrackIO source's identifier; may be empty
  std::optional<std::uint16_t> sequence;        ///< grows by one a packet, modulo 65536
  std::optional<std::int64_t> capture_time_ns;  ///< by the sender's clock, from that clock's epoch
  std::optional<Timecode> timecode;             ///< of the video frame that the sender saw it by
  Vec3 place{0.0};  ///< the entrance pupil in the tracker's world, metres
  Mat3 axes{1.0};   ///< columns: the camera's right, forward and up in the tracker's world
  std::optional<double> focal_length_mm;   ///< the pinhole model's
  std::optional<double> sensor_width_mm;   ///< of the part of the sensor that the picture shows
  std::optional<double> sensor_height_mm;  ///< likewise
  Vec2 projection_offset_mm{
      0.0};  ///< the principal point from the picture's middle, right and down
  std::vector<double> distortion;          ///< as in Camera
  std::optional<double> focus_distance_m;  ///< what is sharp, from the entrance pupil
  std::optional<double> f_number;
};

/// The turn by \p pan about z, then \p tilt about the turned x, then \p roll about the turned y, each
/// in degrees and right-handed: pan to the left as seen from above, tilt upwards, roll clockwise as
/// the camera's operator sees it. Columns as in TrackedPose::axes.
Mat3 axes_of_angles(double pan, double tilt, double roll);

/// A camera in a scene's coordinates (metres, y up: the tracker's (x, y, z) is the scene's (x, z, -y)),
/// as in Camera: x_cam = R X + t.
struct Extrinsics {
  Mat3 R{1.0};
  Vec3 t{0.0};
};

Extrinsics extrinsics_of(const TrackedPose& pose);

/// The other way: place and axes of \p pose from \p extrinsics, whose R is a rotation.
void set_extrinsics(TrackedPose& pose, const Extrinsics& extrinsics);

/// The diameter of the entrance pupil, metres: focal length over f-number; 0 where the pose does not
/// tell both.
double aperture_of(const TrackedPose& pose);

/// Adds to \p pose what it does not tell and \p lens does. A field of view is a focal length before the
/// pose's sensor, or before one of 36 mm where its width is not known. The place moves to the entrance
/// pupil unless it \p is_at_pupil already.
void add_lens(TrackedPose& pose, const LensState& lens, bool is_at_pupil);

/// \p pose as a camera of \p width by \p height pixels, \p pixel_aspect times as wide as high, in a
/// scene's coordinates. The field of view is the lens's where the pose tells the focal length and the
/// sensor's width or height (the width counts where both are known), else \p vertical_degrees from the
/// bottom of the picture to its top.
/// Throws Error (bad_input) for an empty picture, for a field of view that is not between 0° and
/// 180°, and for a pose with numbers that are not finite or lengths not above 0.
Camera camera_of(const TrackedPose& pose, int width, int height, double vertical_degrees,
                 double pixel_aspect = 1.0);

}  // namespace polyhull
