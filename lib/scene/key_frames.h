// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A viewport that moves by key frames of a file (docs/viewport.md).
///
/// Between two key frames each coordinate of eye and target, and the field of view, is a cubic of
/// time (Hermite's), so that the viewport looks at the target whatever the eye does. Its slopes at
/// both ends are those that the easing says, as multiples of the mean speed; of a smooth move they
/// are Catmull and Rom's central differences, limited so that each coordinate is monotone between
/// key frames (F. Fritsch and R. Carlson, "Monotone piecewise cubic interpolation", SIAM J. Numer.
/// Anal. 17, 1980): nothing swings past a key frame, and what two have in common stands still.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "scene/viewport_control.h"

namespace polyhull {

/// How a viewport comes to a key frame from the one before.
enum class Easing {
  smooth,       ///< at the speed of the key frames around; at rest at both ends of a shot
  linear,       ///< at even speed
  ease_in,      ///< from rest
  ease_out,     ///< to rest
  ease_in_out,  ///< both
};

struct KeyFrame {
  double time = 0.0;  ///< seconds, not below 0
  ViewportPose pose;
  double field_of_view = 52.0;  ///< degrees from the lower to the upper edge, 1 to 170
  Easing easing = Easing::smooth;
  bool cut = false;  ///< nothing moves from the one before to this one
};

class KeyFrames {
 public:
  /// What is seen at one time.
  struct View {
    ViewportPose pose;
    double field_of_view = 52.0;
    std::size_t shot = 0;  ///< how many cuts there were
  };

  /// \p keys in order of time, one or more; of two at one time the second is a cut.
  explicit KeyFrames(std::vector<KeyFrame> keys);

  /// The viewport at \p seconds: that of the first key frame before it, of the last behind it.
  View at(double seconds) const;

  std::size_t size() const { return keys_.size(); }

 private:
  using Values = std::array<double, 7>;  // eye, target, field of view
  double slope_at(std::size_t key, std::size_t segment, std::size_t value) const;
  double mean_slope(std::size_t segment, std::size_t value) const;
  bool is_move(std::size_t segment) const;

  std::vector<KeyFrame> keys_;
  std::vector<Values> values_;
  std::vector<std::size_t> shots_;
};

/// Reads the key frames of \p text, JSON as docs/viewport.md has it. Throws Error (bad_input), which
/// begins with \p source and names the key frame and member: what is missing, unknown or out of
/// range, and what was expected.
KeyFrames parse_key_frames(std::string_view text, const std::string& source);

/// Those of the file \p path. Throws Error (not_found) where it cannot be read, and as
/// parse_key_frames().
KeyFrames load_key_frames(const std::string& path);

}  // namespace polyhull
