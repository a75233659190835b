// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What rays from a viewport see of a lit scene, followed through mirrors. No noise.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "raytrace/light_cache.h"
#include "rig/lens.h"
#include "view/view_renderer.h"

namespace polyhull {

/// Rays shaded together: a tile of 16 x 16.
inline constexpr std::size_t ray_batch = 256;

/// A ray on its way, and how it changes to the next pixels. After a planar mirror the origin is the
/// mirrored eye, so that distances along it stay distances from the eye.
struct Way {
  Ray ray;
  Vec3f dx, dy;
  Vec3f throughput;
  std::uint32_t slot;  // whose value it adds to
};

struct RayWork {
  std::array<Way, ray_batch> ways;
  std::array<Ray, ray_batch> rays;
  std::array<RayHit, ray_batch> hits;
  std::array<Vec3f, ray_batch> values;
};

class ViewRays {
 public:
  /// All but \p camera must outlive this.
  ViewRays(const TracedScene& scene, const LightCache& light, const Camera& camera,
           const ViewOptions& options);

  /// The way through the real pixel (x, y).
  Way way(float x, float y, std::uint32_t slot) const;

  /// The way that a planar mirror makes of \p way, whose reflectance \p f is.
  Way mirrored(const Way& way, const Mirror& mirror, const Vec3f& f) const;

  /// Follows the first \p count ways of \p work, which \p depth mirrors have turned already, to
  /// their ends; values gets the picture values. Returns the number of rays.
  std::uint64_t follow(RayWork& work, std::size_t count, int depth = 0) const;

 private:
  bool shade(const Way& way, const RayHit& hit, Vec3f& value, Way& next) const;

  const TracedScene& scene_;
  const LightCache& light_;
  const ViewOptions& options_;
  float exposure_;
  Vec3f eye_;
  std::optional<Lens> lens_;  // none: the viewport does not distort
  Vec3f corner_, step_x_, step_y_;
};

}  // namespace polyhull
