// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A hull as its cameras, or any other camera, would see it: one ray per pixel (Embree).
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"

namespace polyhull::report {

/// What one pixel's ray meets first.
struct Hit {
  std::int32_t triangle = -1;  ///< -1: nothing
  float u = 0.0f, v = 0.0f;    ///< barycentric weights of the triangle's second and third vertex
};

/// Row-major hits of a whole frame.
struct HitPicture {
  int width = 0;
  int height = 0;
  std::vector<Hit> hits;
  const Hit& at(int x, int y) const { return hits[static_cast<std::size_t>(y) * width + x]; }
};

class HullCaster {
 public:
  explicit HullCaster(const Hull& hull);
  ~HullCaster();
  HullCaster(const HullCaster&) = delete;
  HullCaster& operator=(const HullCaster&) = delete;

  /// Casts through every pixel centre of \p camera, lens distortion included.
  HitPicture cast(const Camera& camera) const;

  /// World position of a hit.
  Vec3 position(const Hit& hit) const;

  /// Outward unit normal of a triangle.
  Vec3 normal(std::int32_t triangle) const;

  /// Whether the open segment from \p from to \p to meets the hull.
  bool blocked(const Vec3& from, const Vec3& to) const;

 private:
  const Hull& hull_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace polyhull::report
