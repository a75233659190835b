// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/properties.h"

namespace polyhull::element {

template <>
GType enum_type<TrackMatch>() {
  return register_enum<TrackMatch>(
      "PolyhullTrackMatch",
      {{TrackMatch::running_time, "Running time: a pose's buffer has the time at which it was true",
        "running-time"},
       {TrackMatch::timecode, "Timecode of the frames and of the poses", "timecode"}});
}

std::span<const Property<ViewportSettings>> field_of_view_properties() {
  static constexpr Property<ViewportSettings> table[] = {property<&ViewportSettings::field_of_view>(
      "field-of-view",
      "Angle from the lower to the upper edge of the picture, in degrees (1 to 170), where the "
      "track does not tell the lens.",
      1, 170)};
  return table;
}

std::span<const Property<TrackStampSettings>> track_match_properties() {
  using S = TrackStampSettings;
  static const Property<S> table[] = {
      property<&S::match>("track-match", "By what a pose at the pad track finds its frame."),
      property<&S::delay>(
          "track-delay",
          "By how many nanoseconds a pose at the pad track holds later than it says (-10 s to 10 "
          "s): what the video is late against its timecode or its time.",
          -1e10, 1e10)};
  return table;
}

}  // namespace polyhull::element
