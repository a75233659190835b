// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A picture's light in two layers, the scene and the subjects before it: what is blurred apart, since
/// what a subject hides is known, so that its blurred border is transparent. Codes become light once,
/// each blur makes layers of layers, and what comes out becomes codes once.
#pragma once

#include <cstdint>
#include <vector>

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
  std::vector<float> scene[3];  ///< red, green and blue, linear, row by row
  /// What the subject adds to the scene's, which shows as far as the coverage, which is last, leaves
  /// it. Light of which no depth is known is the scene's.
  std::vector<float> subject[4];
  Rectangle part;  ///< beyond it there is no subject

  /// Writes channel \p c of both layers together, of \p count pixels from \p first on.
  void picture(std::size_t c, std::size_t first, int count, float* to) const;

  /// Takes this size, and no subject but in \p subjects; what is in it is to be written.
  void resize(int columns, int rows, const Rectangle& subjects);

  /// Reads \p sharp, which has the size of \p depths.
  void read(const DepthLayers& depths, const SharpPictures& sharp);

  /// Writes them into \p target, rows \p target_stride bytes apart, with the alpha of \p full.
  void write(const std::uint8_t* full, int stride, std::uint8_t* target, int target_stride) const;

  /// The pixel there, or the picture's nearest.
  std::size_t pixel(int x, int y) const {
    const int column = x < 0 ? 0 : x >= width ? width - 1 : x;
    const int row = y < 0 ? 0 : y >= height ? height - 1 : y;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(column);
  }
};

}  // namespace polyhull
