// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From what people write down to the keyer's settings: reads the files they name, once each.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "silhouette/key/key.h"

namespace polyhull {

/// KeySettings with colours as numbers (0xRRGGBB, -1: sampled from the picture) and pictures as
/// paths (empty: none): the properties of chromamatte and silhouette.
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

/// The settings of one stream's keyer, as far as files can be read. For one thread.
class KeyConfiguration {
 public:
  /// Makes settings of \p values for frames of \p width x \p height from \p camera (a name in the
  /// rig file; used only where a rig is set) and hands them to \p accept if anything changed since
  /// the last call. Files are read again only when their path or the frames' size changes.
  ///
  /// Throws Error for what cannot be used (a file that is missing or of another size, values that
  /// contradict each other), once; the settings of before stay in force, if has_settings().
  void apply(const KeyValues& values, const std::string& camera, int width, int height,
             const std::function<void(const KeySettings&)>& accept);

  /// Whether there are settings for frames of \p width x \p height.
  bool has_settings(int width, int height) const {
    return in_force_ && width == in_force_->width && height == in_force_->height;
  }

  /// Counts a frame, and has the keyer sample or learn anew with it where \p values ask for that;
  /// true: they did.
  bool sample_and_learn(const KeyValues& values, const std::function<Keyer&()>& keyer);

 private:
  struct Request {
    KeyValues values;
    std::string camera;
    int width = 0;
    int height = 0;
    bool operator==(const Request&) const = default;
  };
  KeySettings settings_for(const Request& request) const;
  bool due_for_sampling(int resample);
  std::shared_ptr<const Picture> outside_mask(const Request& request, Rings& outside) const;

  std::optional<Request> in_force_;
  std::optional<Request> refused_;
  KeySettings settings_;
  int frames_since_sampling_ = 0;
  int learning_ = 0;
};

}  // namespace polyhull
