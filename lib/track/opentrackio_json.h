// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The parts of an OpenTrackIO sample (SMPTE RIS OSVP, protocol 1.0) and of its OpenLensIO lens model
/// as numbers. Not for public headers: it needs nlohmann's. All throw Error (bad_input).
///
/// World: metres, z up; a camera without rotation looks along y, x to its right. Transforms are from
/// parent to child, each rotation about z (pan), then the turned x (tilt), then y (roll), right-handed.
/// A transform's scale stretches the translations of those within it; a camera's axes and lens have
/// none. Lens: with F the pinhole focal length and (x, y) a point on the sensor without distortion, all
/// in mm from the centre of projection, y down, s = x^2 + y^2, l1... the radial and q1 q2 the
/// tangential coefficients of the model from undistorted to distorted ("U-D"),
///
///     x' = x (1 + l1 s + l3 s^2 + l5 s^3) / (1 + l2 s + l4 s^2 + l6 s^3) + 2 q1 x y + q2 (s + 2 x^2)
///
/// and y' likewise: OpenCV's model in mm. With x = F x_n the radial k of OpenCV is l F^(2n) and the
/// tangential p is q F, since that term is added (the group's paper on the conversion says F^2).
/// The model from distorted to undistorted ("D-U"), which holds where none is named, is the same
/// formula the other way (inverse_distortion.h).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/vector.h"
#include "track/inverse_distortion.h"
#include "track/timecode.h"

namespace polyhull::opentrackio {

/// The value at a path such as /lens/distortion, or null.
const nlohmann::json* find(const nlohmann::json& root, const char* path);

/// \p value as a finite number; \p what says in the message which.
double number(const nlohmann::json* value, const std::string& what);

/// The number at \p path; 0 where there is none.
double number_or_zero(const nlohmann::json& root, const char* path);

/// The number above 0 at \p path; none where there is nothing.
std::optional<double> length(const nlohmann::json& root, const char* path);

/// The camera's axes (columns: right, forward, up) and its entrance pupil in the world.
struct Placed {
  Mat3 axes{1.0};
  Vec3 place{0.0};
};

/// As `transforms` and `lens.entrancePupilOffset` say; without transforms the origin. Refuses a scale
/// that is not above 0.
Placed placed(const nlohmann::json& root);

/// The height over the width of a square's image on the sensor (`static.camera.anamorphicSqueeze`): 2
/// for a lens that squeezes by 2; none where it is not told.
std::optional<double> squeeze(const nlohmann::json& root);

/// `timing.timecode`, whose `subFrame` is one of as many as `timing.sampleRate` has samples in a frame,
/// else of two, as fields are; none where there is none that could be one, as senders have that know of
/// no video.
std::optional<Timecode> timecode(const nlohmann::json& root);

/// Whether `lens.distortion`, one model or a list of them, holds a coefficient that is not 0: senders of
/// lenses that do not distort tell models of any name.
bool distorts(const nlohmann::json& root);

/// OpenCV's coefficients of `lens.distortion` for a focal length of \p f mm; empty where the list is
/// empty or missing, zeros where it holds no other number. Those of "Brown-Conrady U-D" where it is there; else of "Brown-Conrady D-U", of
/// which the sensor is fitted up to \p reach mm from the centre of projection, to half a pixel of
/// 1920, with what \p last holds. Throws Error where the lens cannot be told so: for another model,
/// for a `distortionOffset` that is not 0, and where nothing fits.
std::vector<double> opencv_distortion(const nlohmann::json& root, double f, const Vec2& reach,
                                      FittedDistortion& last);

}  // namespace polyhull::opentrackio
