// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Whether a picture's edges are mixtures of light, as a camera's lens and sensor make them, or of the
/// numbers that stand for it, as programs often do. Internal.
///
/// Numbers are close to a power of light. So what mixes light runs from the screen's colour to the
/// subject's along a curve, for the channel that changes most bends most, and what mixes numbers runs
/// along a straight line. Pixels that lie on the one rather than on the other tell, where the curve is
/// clearly away from the line.
#pragma once

#include <array>

#include "base/vector.h"

namespace polyhull::silhouette {

/// (1 - alpha) screen + alpha subject in light, all in levels 0..255.
Vec3f mixed_in_light(const Vec3f& screen, const Vec3f& subject, float alpha);

class Mixing {
 public:
  /// A pixel of a frame between a screen and a subject, in levels; \p noise of a channel in levels.
  void add(const Vec3f& screen, const Vec3f& subject, const Vec3f& pixel, double noise);
  /// Ends a frame. The one that shows most such pixels counts, so that the same frame again changes
  /// nothing.
  void finish_frame();
  /// Whether enough has been seen.
  bool is_sure() const { return most_.count >= enough; }
  bool in_light() const { return most_.light < clearly * most_.numbers; }

 private:
  static constexpr int pieces = 8;                 // straight ones of the curve
  static constexpr int least = 10, enough = 4000;  // pixels
  static constexpr double clearly =
      0.55;  // hair that mixes numbers has 0.59, hair that mixes light 0.50
  struct Distances {
    int count = 0;
    double light = 0.0, numbers = 0.0;  // squared
  };
  Distances frame_, most_;
  // What runs from the last screen to the last subject, which many pixels have: found once for them.
  struct Curve {
    Vec3f screen{-1.0f}, subject{-1.0f};
    bool complete = false;
    std::array<Vec3f, pieces + 1> points{};
  };
  Curve curve_;
};

}  // namespace polyhull::silhouette
