// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of depth_of_field.h, compiled once per instruction set (focus_loops.inc) and chosen
/// at run time.
#pragma once

#include "base/instruction_set.h"

namespace polyhull::lens {

inline constexpr int focus_row = 16;  ///< pixels, of which each call but disks() makes a row

/// Planes of pixels and of the disks that they become. In rows, with room around for all offsets.
struct DiskPlanes {
  const float* light[4];  ///< linear; the last, a subject's coverage, only of subjects
  const float* circle;    ///< c
  const float* radius;    ///< as it is drawn
  const float* inverse_area;
};

/// A pixel near another: where it lies in the planes, how far away, and for how many it stands.
struct DiskOffset {
  int at;
  float distance, share;
};

/// By the true radius the one that is drawn, and by that one over the area: \p steps to a pixel.
struct DiskTables {
  const float *drawn_radius, *inverse_area;
  float steps, most_radius;
};

struct FocusLoops {
  /// The disks of pixels of the depths 1 / \p inverse: c = scale (inverse - focus).
  void (*disks)(const DiskTables& tables, float scale, float focus, const float* inverse, int count,
                float* circle, float* radius, float* inverse_area);
  /// The light where all circles are alike.
  void (*even)(const DiskPlanes& scene, const DiskOffset* offsets, int count,
               float (*light)[focus_row]);
  /// The scene's light, and with \p body, which subject() and cover() have made, that of both.
  void (*scene)(const DiskPlanes& scene, const DiskOffset* offsets, int count,
                const float (*body)[focus_row], const float* body_circle,
                float (*light)[focus_row]);
  /// The subject's light, its coverage last, and the mean of its circles.
  void (*subject)(const DiskPlanes& subject, const DiskOffset* offsets, int count,
                  float (*light)[focus_row], float* circle);
  /// Scales \p light to the coverage that it would have, were its disks of these alone.
  void (*cover)(const DiskPlanes& subject, const DiskOffset* offsets, int count,
                const float* radius, const float* inverse_area, float (*light)[focus_row]);

  static const FocusLoops& baseline();
  static const FocusLoops& avx2();
  static const FocusLoops& best() { return best_loops<FocusLoops>(); }
};

}  // namespace polyhull::lens
