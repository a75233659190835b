// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of rigtestsrc.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "studio/cameras/camera_picture.h"

namespace polyhull::element {

enum class ScreenColour { green, blue };
enum class RigOutput { picture, keyed, matte, depth };

/// What users can set on rigtestsrc; delay and jitter in ns.
struct RigTestSettings {
  std::string rig;
  std::string camera;
  std::string subject = "figure";
  double subject_height = 0.0;
  ScreenColour screen = ScreenColour::green;
  double unevenness = 0.06;
  double shadow = 0.25;
  double spill = 0.05;
  double noise = 1.0;
  std::uint32_t seed = 0;
  bool linear_light = false;
  double speed = 1.0;
  double start = 0.0;
  RigOutput output = RigOutput::picture;
  PictureQuality quality = PictureQuality::fast;
  double depth_scale = 0.0002;
  std::string mesh_location;
  bool stamp = false;
  bool live = false;
  std::uint64_t delay = 0;
  std::uint64_t jitter = 0;
};

/// One row per property of RigTestSettings.
std::span<const Property<RigTestSettings>> rig_test_properties();

}  // namespace polyhull::element
