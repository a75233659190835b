// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops that turn frames into RGBA, compiled for several instruction sets from one
/// source. All variants give the same bytes: everything is integer arithmetic. Internal.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"
#include "silhouette/pixels/frame.h"

namespace polyhull::silhouette {

/// What despill takes away: with d = min(a . rgb, b . rgb), which must fit 16 bit, where d > 0
/// channel c loses (s * take[c] + 2^14) >> 15, clamped to a byte; s is d up to `everywhere`, and of
/// what exceeds that the pixel's weight, 0..32767 of 32768. All take 0: nothing.
struct DespillForms {
  std::int16_t a[3] = {};
  std::int16_t b[3] = {};
  std::int16_t take[3] = {};
  std::int16_t everywhere = 32767;
};

struct ColourKernels {
  /// Pixels [x0, x1) of row y of a Y'CbCr frame as R, G, B, 255.
  void (*convert_yuv)(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba);

  /// The same of a colour sensor's mosaic.
  void (*convert_bayer)(const FrameView& frame, int y, int x0, int x1, std::uint8_t* rgba);

  /// As convert_yuv, despilled with weights[x - x0], with alpha[x - x0] as alpha.
  void (*composite_yuv)(const FrameView& frame, int y, int x0, int x1, const DespillForms& despill,
                        const std::int16_t* weights, const std::uint8_t* alpha, std::uint8_t* rgba);

  /// `count` four-byte pixels as R, G, B (bytes 0 and 2 exchanged with \p swap), despilled with
  /// weights[i], with alpha[i] as alpha. \p pixels and \p rgba may be the same.
  void (*composite)(const std::uint8_t* pixels, int count, bool swap, const DespillForms& despill,
                    const std::int16_t* weights, const std::uint8_t* alpha, std::uint8_t* rgba);

  static const ColourKernels& baseline();
  static const ColourKernels& avx2();
  static const ColourKernels& best() { return best_loops<ColourKernels>(); }
};

}  // namespace polyhull::silhouette
