// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of motion_blur.h, compiled once per instruction set (motion_loops.inc) and chosen at
/// run time.
#pragma once

#include "base/instruction_set.h"

namespace polyhull::lens {

inline constexpr int motion_row = 8;  ///< pixels that blur() makes

/// u' ~ a (u, 1) + w b (motion_blur.h). Motions are those of the share of the time in which the shutter
/// is open, and of \p most pixels at most.
struct MotionMap {
  float a[3][3], b[3];
  float share, most;
};

/// A layer of a whole picture, in planes without gaps.
struct MovingLayer {
  const float* light[4];  ///< linear; the last, its coverage, only of subjects
  const float* inverse;   ///< 1/z
  const float *x, *y;     ///< how far what is there moves, in pixels
  int width, height;
};

/// Pixels of one row to be blurred, from (x, y) on.
struct MotionSpan {
  int x, y;
  int steps;
  bool still;     ///< the scene does not move
  bool smooth;    ///< nothing of the scene that comes here moves otherwise than what is beside it
  bool parallax;  ///< else: what of it is nearest and farthest moves otherwise
  float nearest, farthest;  ///< 1/z
};

struct MotionLoops {
  /// The motions of \p count pixels from (x, y) on, of the depths 1 / \p inverse.
  void (*motions)(const MotionMap& map, int x, int y, const float* inverse, int count,
                  float* motion_x, float* motion_y);
  /// The light of \p span while the shutter is open; \p subject may be null.
  void (*blur)(const MotionMap& map, const MovingLayer& scene, const MovingLayer* subject,
               const MotionSpan& span, float (*light)[motion_row]);

  static const MotionLoops& baseline();
  static const MotionLoops& avx2();
  static const MotionLoops& best() { return best_loops<MotionLoops>(); }
};

}  // namespace polyhull::lens
