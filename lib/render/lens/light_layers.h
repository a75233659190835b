// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A sharp picture's light in two layers, the scene and the subjects before it: what is blurred apart,
/// since what a subject hides is known, so that its blurred border is transparent.
#pragma once

#include <cstdint>
#include <vector>

#include "raytrace/float4.h"
#include "render/lens/depth_layers.h"

namespace polyhull {

/// Sharp pictures, RGBA rows \p stride bytes apart.
struct SharpPictures {
  const std::uint8_t*
      scene;  ///< without the subject before it, but with its shadow and mirror image
  const std::uint8_t* full;  ///< with it; the same memory: there is none
  int stride;
};

struct LightLayers {
  int width = 0, height = 0;
  std::vector<Float4> scene;  ///< linear, row by row; the last is 0
  /// Linear, times the coverage, which is last. Light of which no depth is known is the scene's.
  std::vector<Float4> subject;
  std::vector<float> subject_inverse;  ///< 1/z, metres; 0 where there is none

  /// Reads \p sharp, which has the size of \p depths.
  void read(const DepthLayers& depths, const SharpPictures& sharp);

  /// The pixel there, or the picture's nearest.
  std::size_t pixel(int x, int y) const {
    const int column = x < 0 ? 0 : x >= width ? width - 1 : x;
    const int row = y < 0 ? 0 : y >= height ? height - 1 : y;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
};

}  // namespace polyhull
