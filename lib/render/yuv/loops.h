// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of yuv_picture.h, compiled once per instruction set (loops.inc) and chosen at
/// run time: whole numbers, vectorised by the compiler.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull::yuv {

struct Loops {
  /// The Y' of \p count RGBA pixels.
  void (*luma)(const std::uint8_t* rgba, int count, std::uint8_t* y);
  /// The chroma of \p count pairs of columns of two rows of RGBA pixels. Pair k takes pixels 2k - 1,
  /// 2k and 2k + 1: one pixel to the left of \p top and \p bottom is read.
  void (*chroma)(const std::uint8_t* top, const std::uint8_t* bottom, int count, std::uint8_t* cb,
                 std::uint8_t* cr);
  /// The same, cb and cr in turn.
  void (*chroma_in_turn)(const std::uint8_t* top, const std::uint8_t* bottom, int count,
                         std::uint8_t* out);

  static const Loops& baseline();
  static const Loops& avx2();
  static const Loops& best() { return best_loops<Loops>(); }
};

}  // namespace polyhull::yuv
