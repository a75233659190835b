// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A rig: the calibrated cameras of one stage, and its file format (docs/formats.md).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/camera.h"

namespace polyhull {

/// Cameras in one world, whose unit and up direction are the calibration's own.
struct Rig {
  std::vector<Camera> cameras;
  std::optional<Bounds> bounds;  ///< the working volume, in world units
  Vec3 up{0.0, 1.0, 0.0};        ///< world direction that points up
  std::string unit = "m";        ///< "m", "cm", "mm", "in", "ft" or a number of metres ("0.37")

  /// The camera called \p name, or null.
  const Camera* find(std::string_view name) const;

  /// Metres per world unit. Throws Error where `unit` is none of those.
  double metres_per_unit() const;
};

/// Of m, cm and mm the unit in which \p units are the nearest to \p usual metres.
std::string likely_unit(double units, double usual);

/// Reads a rig file. Throws Error naming the file and what is wrong where: missing file, not JSON
/// (line and column), wrong format or version, no camera, one named twice or not at all, pictures
/// not of 1 to 32768 pixels a side, K not upper triangular or with focal lengths not above 0, a
/// number of distortion coefficients that the model does not have, a rotation not orthonormal or a
/// reflection, numbers that are not finite, bounds turned inside out, no up direction or unit.
Rig load_rig(const std::string& path);

/// Like load_rig() on text; \p source names it in messages.
Rig parse_rig(std::string_view json, const std::string& source);

/// The rig as its file format, indented, numbers with 17 significant digits.
std::string rig_to_json(const Rig& rig);

/// Throws Error if \p rig breaks a rule of load_rig(); for rigs made by programs.
void validate_rig(const Rig& rig, const std::string& source);

/// Throws Error, naming \p where, if \p camera alone breaks a rule of load_rig().
void validate_camera(const Camera& camera, const std::string& where);

}  // namespace polyhull
