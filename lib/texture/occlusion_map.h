// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// From a view's depths of the mesh to its OcclusionMap: nearest depth, and a fade that is 0 within
/// a margin of silhouette edges and depth discontinuities and rises to 1 over a settable width.
#pragma once

#include <algorithm>
#include <limits>

#include "rig/camera.h"
#include "texture/texture_loops.h"
#include "texture/texturing.h"

namespace polyhull {

/// Where points of the mesh lie in a view's picture.
struct PictureBounds {
  static constexpr float none = std::numeric_limits<float>::max();
  float low_x = none, high_x = -none, low_y = none, high_y = -none;  ///< pinhole pixels
  float farthest = none, nearest = 0.0f;                             ///< 1 / depth
  bool behind = false;                                               ///< some lie behind the camera

  /// \p inverse is 1 / depth, 0 for a point behind the camera.
  void add(float x, float y, float inverse) {
    if (inverse > 0.0f) {
      low_x = std::min(low_x, x);
      high_x = std::max(high_x, x);
      low_y = std::min(low_y, y);
      high_y = std::max(high_y, y);
      farthest = std::min(farthest, inverse);
      nearest = std::max(nearest, inverse);
    } else {
      behind = true;
    }
  }
};

/// A map without texels' contents around what lies in the picture, its longer side at most \p size
/// texels (at least 8); width 0 where nothing does.
OcclusionMap lay_out_map(const PictureBounds& bounds, const Camera& camera, int size);

/// Whether the camera's frame, grown by \p margin pixels beyond the centres of its outer pixels,
/// holds the real pixel of the pinhole pixel \p ideal.
bool in_frame(const Camera& camera, const Vec2& ideal, double margin);

/// Whether the map reaches beyond the camera's frame. One whose rim lies inside the frame does so as
/// a whole: lenses bend no more than that here.
bool leaves_frame(const OcclusionMap& map, const Camera& camera);

/// Fills the map from \p grid, which has \p finer times \p finer texels for each of it; \p fade_width
/// in pixels of the camera.
void finish_map(const DepthGrid& grid, int finer, const Camera& camera, double fade_width,
                OcclusionMap& map, const TextureLoops& loops = TextureLoops::best());

}  // namespace polyhull
