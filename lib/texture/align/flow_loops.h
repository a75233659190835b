// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of optical flow (flow.h), compiled once per instruction set (flow_loops.inc) and
/// chosen at run time. The results are the same to the bit: plain C++ without contraction.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull {

/// A picture in three channels, row by row, with how much each texel counts, 0..1.
struct FlowPicture {
  const float* channel[3];
  const float* weight;
};

/// The equations of each texel's step (a, b) -> what the pictures ask for: J (dx, dy) = r.
struct FlowEquations {
  static constexpr int count = 5;
  float* of[count];  ///< J_xx, J_xy, J_yy, r_x, r_y
};

/// All arrays are width x height; texels of the outermost rows and columns are not written.
struct FlowLoops {
  /// What \p from has at each texel moved by (dx, dy), and in \p weight how much it counts there:
  /// \p own times 0 beside anything that does not count.
  void (*warp)(const FlowPicture& from, const float* own, int width, int height, const float* dx,
               const float* dy, float* const (&moved)[3], float* weight);
  /// The equations of one texel each: what takes \p moved, which counts \p weight, to \p to.
  void (*equations)(const float* const (&moved)[3], const float* weight, const FlowPicture& to,
                    int width, int height, const FlowEquations& out);
  /// \p out: the means of 3 x 3 texels of \p in, weighted 1 2 1; \p rows: room for one array.
  void (*smooth)(const float* in, int width, int height, float* rows, float* out);
  /// One step of Jacobi's method for  J d + smoothness (d - mean of four neighbours) + rest d = J
  /// d_0 + r;  t: J d_0 + r. \p rest by texel.
  void (*relax)(const FlowEquations& equations, const float* target_x, const float* target_y,
                const float* rest, float smoothness, int width, int height, const float* dx,
                const float* dy, float* next_dx, float* next_dy);

  static const FlowLoops& baseline();
  static const FlowLoops& avx2();
  static const FlowLoops& best() { return best_loops<FlowLoops>(); }
};

}  // namespace polyhull
