// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The inner loops of distorted_view.h, compiled once per instruction set (resample_loops.inc) and
/// chosen at run time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull::lens {

/// An RGBA picture.
struct PictureSource {
  const std::uint8_t* pixels;
  std::ptrdiff_t stride;  ///< bytes
  int width, height;
};

/// Places in a picture on a cubic curve, of which each run is an eighth further: place i is at
/// ((c3 t + c2) t + c1) t + c0 with t = (first + i) / 8. Pixel centres are whole numbers.
struct PlaceRun {
  float x[4], y[4];
  int first, count;  ///< together 8 at most
};

struct ResampleLoops {
  /// Writes the picture's values at the places of \p run, as codes, by Catmull and Rom's cubics; beyond its
  /// borders it goes on as its last pixels.
  void (*resample)(const PictureSource& picture, const PlaceRun& run, std::uint8_t* out);
  /// The same, but only where one of the 16 pixels that count differs from that of \p before, which
  /// has the same size and stride; the rest of \p out stays.
  void (*resample_changed)(const PictureSource& picture, const std::uint8_t* before,
                           const PlaceRun& run, std::uint8_t* out);

  static const ResampleLoops& baseline();
  static const ResampleLoops& avx2();
  static const ResampleLoops& best() { return best_loops<ResampleLoops>(); }
};

}  // namespace polyhull::lens
