// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of chromamatte, which silhouette has too.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "silhouette/key/key.h"

namespace polyhull::element {

struct KeyValues {
  KeyMethod method = KeySettings{}.method;
  KeyColour key = KeySettings{}.key;
  std::uint32_t key_colour = 0x00ff00;
  int strength = KeySettings{}.strength;
  int bright_threshold = KeySettings{}.bright_threshold;
  double red_gain = KeySettings{}.red_gain;
  double blue_gain = KeySettings{}.blue_gain;
  int roi_x = 0;
  int roi_y = 0;
  int roi_width = 0;
  int roi_height = 0;
  int screen_colour = -1;
  int foreground_colour = -1;
  bool uneven = KeySettings{}.uneven;
  int resample = 0;
  double clip_black = KeySettings{}.clip_black;
  double clip_white = KeySettings{}.clip_white;
  double choke = KeySettings{}.choke;
  double close = KeySettings{}.close;
  double spill = KeySettings{}.spill;
  std::string clean_plate;
  int learn_plate = 0;
  double difference_low = KeySettings{}.difference_low;
  double difference_high = KeySettings{}.difference_high;
  double shadow_darkest = KeySettings{}.shadow_darkest;
  double light_brightest = KeySettings{}.light_brightest;
  std::string outside_mask;
  std::string inside_mask;
  std::string outside_polygon;
  std::string inside_polygon;
  std::string rig;
  bool operator==(const KeyValues&) const = default;
};

std::span<const Property<KeyValues>> key_properties();

/// What chromamatte shows on its output; silhouette has no such property.
struct KeyViewValues {
  KeyView view = KeyView::composite;
};

std::span<const Property<KeyViewValues>> key_view_properties();

}  // namespace polyhull::element
