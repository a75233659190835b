// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What users can set on tracksrc.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "track/pose_reader.h"
#include "track/track.h"

namespace polyhull::element {

/// Times in ns, places in metres, angles in degrees.
struct TrackInputSettings {
  TrackProtocol protocol = TrackProtocol::automatic;
  std::string address = "0.0.0.0";
  std::uint32_t port = 55555;
  std::string multicast_iface;
  std::string location;
  std::string record;
  std::string source;
  std::string axes = "xyz";
  bool invert_pan = false, invert_tilt = false, invert_roll = false;
  double offset_x = 0.0, offset_y = 0.0, offset_z = 0.0;
  double offset_pan = 0.0, offset_tilt = 0.0, offset_roll = 0.0;
  FreeDChecksum checksum = FreeDChecksum::required;
  bool zoom_is_focal_length = false;
  std::string lens_file;
  double sensor_width = 0.0;  // mm
  TrackTimes times = TrackTimes::sender;
  std::uint64_t delay = 0;
  std::uint64_t smoothing = 0;
  std::uint64_t prediction = 0;
};

std::span<const Property<TrackInputSettings>> track_input_properties();

/// What the reader of packets needs of them, but for the lens file, which is read once. Throws Error
/// for axes that are none.
PoseReaderSettings reader_settings(const TrackInputSettings& settings);
/// What the track needs of them; the receiver of the poses predicts.
TrackSettings track_settings(const TrackInputSettings& settings);

}  // namespace polyhull::element
