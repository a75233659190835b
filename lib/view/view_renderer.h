// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The fast picture of a lit scene: camera rays, mirror rays and the light cache. No noise.
///
/// One ray through the middle of each pixel first; pixels that differ from a neighbour by more than
/// `contrast` are drawn anew with eight rays spread over their square. Textures are filtered over
/// the pixel's footprint, also in mirrors.
#pragma once

#include <span>

#include "raytrace/light_cache.h"

namespace polyhull {

/// How views are drawn.
struct ViewOptions {
  /// Of neighbouring pixels' sRGB values (0..1) from which edges are smoothed.
  float contrast = 0.045f;
  int mirror_depth = 4;  ///< how many mirrors a ray follows
  int threads = 0;       ///< of the pool, 0: all
};

/// Of one call.
struct ViewStatistics {
  std::uint64_t rays = 0;
  std::uint64_t smoothed = 0;  ///< pixels drawn with eight rays, or that show several triangles
};

/// Draws \p scene, lit by \p light, seen by \p camera, into \p picture (linear picture values, row
/// by row, camera.width * camera.height of them). Subjects of the scene show their colours, but
/// throw no shadow. The result does not depend on the number of threads.
void render_view(const TracedScene& scene, const LightCache& light, const Camera& camera,
                 const ViewOptions& options, std::span<Vec3f> picture,
                 ViewStatistics* statistics = nullptr);

}  // namespace polyhull
