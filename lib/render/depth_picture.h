// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far away what a background shows is, where its maker tells it pixel by pixel.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace polyhull {

struct DepthPicture {
  int width = 0, height = 0;
  /// 1/z at pixels' middles, row by row, z in the scene's metres along the viewport's axis; 0 where
  /// nothing is.
  std::vector<float> inverse;

  /// That of pixel (x, y) of a picture of \p picture_width x \p picture_height that shows the same.
  float at(int x, int y, int picture_width, int picture_height) const {
    const auto part = [](int i, int of, int own) {
      return std::clamp(static_cast<int>((static_cast<std::int64_t>(2 * i + 1) * own) / (2 * of)),
                        0, own - 1);
    };
    return inverse[static_cast<std::size_t>(part(y, picture_height, height)) *
                       static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(part(x, picture_width, width))];
  }
};

/// By how much nearer than the scene's geometry a pixel of a DepthPicture has to be to hide a subject,
/// as a share of the depth: renderers tell the depth of some place within the pixel, and where the
/// scene is known it tells better.
inline constexpr float depth_picture_ahead = 0.02f;

}  // namespace polyhull
