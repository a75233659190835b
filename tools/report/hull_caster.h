// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A hull as its cameras, or any other camera, would see it: one ray per pixel.
#pragma once

#include <vector>

#include "hull/hull.h"
#include "raytrace/ray_caster.h"
#include "rig/camera.h"

namespace polyhull::report {

/// Row-major: what the ray through each pixel centre of a frame meets first.
struct HitPicture {
  int width = 0;
  int height = 0;
  std::vector<RayHit> hits;
  const RayHit& at(int x, int y) const { return hits[static_cast<std::size_t>(y) * width + x]; }
};

class HullCaster {
 public:
  /// \p hull must live as long as the caster.
  explicit HullCaster(const Hull& hull);

  /// Casts through every pixel centre of \p camera, lens distortion included.
  HitPicture cast(const Camera& camera) const;

  /// World position of a hit.
  Vec3 position(const RayHit& hit) const;

  /// Whether the segment from \p from to \p to meets the hull.
  bool blocked(const Vec3& from, const Vec3& to) const;

 private:
  const Hull& hull_;
  RayCaster caster_;
};

}  // namespace polyhull::report
