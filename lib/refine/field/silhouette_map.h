// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far a picture's points are from a silhouette's outline.
#pragma once

#include <vector>

#include "base/rings.h"

namespace polyhull::refine {

/// Signed distances from the outline, pixels, positive inside: of texel (i, j) that of the pixel
/// (left + i * texel, top + j * texel).
struct SilhouetteMap {
  float left = 0.0f, top = 0.0f;
  float texel = 1.0f;  ///< pixels from one to the next
  int width = 0, height = 0;
  std::vector<float> distance;  ///< row by row

  /// Linear between texels; \p beyond where there are none.
  float at(float u, float v, float beyond) const {
    const float x = (u - left) / texel, y = (v - top) / texel;
    if (!(x >= 0.0f && y >= 0.0f && x < static_cast<float>(width - 1) &&
          y < static_cast<float>(height - 1)))
      return beyond;
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const float a = x - static_cast<float>(i), b = y - static_cast<float>(j);
    const float* p = distance.data() + static_cast<std::size_t>(j) * width + i;
    const float* q = p + width;
    const float upper = p[0] + a * (p[1] - p[0]), lower = q[0] + a * (q[1] - q[0]);
    return upper + b * (lower - upper);
  }
};

/// What a map is to show of a picture, in its pixels.
struct PictureBox {
  Vec2f low{-1e30f}, high{1e30f};
};

/// How a map is drawn.
struct MapDrawing {
  float texel = 1.0f;       ///< pixels; more where the map would have more than 4096 of them a side
  int reach = 2;            ///< texels from the outline within which distances are exact
  float margin = 0.0f;      ///< pixels around the outline's box
  bool everywhere = false;  ///< distances beyond reach, too
};

/// Draws maps and keeps what it works with.
struct SilhouetteMapper {
  struct Segment {
    Vec2f begin, way;
    float by_square = 0.0f;  ///< 1 / |way|^2
  };
  std::vector<Segment> segments;
  std::vector<int> nearest;
  std::vector<float> square;
  std::vector<std::vector<float>> crossings;  ///< of the outline with each row

  /// Fills \p map over the outline's box and the margin around it, as far as that lies \p within.
  /// Beyond reach distances are those from the edge that a neighbour found (two sweeps over the map,
  /// after Danielsson, Euclidean Distance Mapping, 1980), or reach * texel.
  void draw(SilhouetteMap& map, const Rings& rings, const MapDrawing& how,
            const PictureBox& within);

 private:
  void seed(const SilhouetteMap& map, int reach, bool with_nearest);
  void sweep(const SilhouetteMap& map);
  void finish(SilhouetteMap& map, float most);
};

}  // namespace polyhull::refine
