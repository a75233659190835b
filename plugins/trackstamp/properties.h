// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of trackstamp that are of the tracked camera and its lens.
#pragma once

#include <cstdint>
#include <span>

#include "plugins/common/camera/camera_track.h"
#include "plugins/common/property_table.h"
#include "plugins/common/viewport.h"

namespace polyhull::element {

template <>
GType enum_type<TrackMatch>();

/// Of ViewportSettings only the field of view and the lens.
struct TrackStampSettings : ViewportSettings {
  TrackMatch match = TrackMatch::running_time;
  std::int64_t delay = 0;  ///< ns; poses hold that much later than they say
};

/// One row per property of TrackStampSettings; the lens's distortion is distortion_properties().
std::span<const Property<ViewportSettings>> field_of_view_properties();
std::span<const Property<TrackStampSettings>> track_match_properties();

}  // namespace polyhull::element
