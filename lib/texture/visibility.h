// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How much of each triangle of a hull each view sees: see texture_hull.h.
#pragma once

#include <span>
#include <vector>

#include "hull/hull.h"
#include "raytrace/ray_caster.h"
#include "rig/camera.h"

namespace polyhull {

/// Camera centres relative to the hull's origin, world units.
std::vector<Vec3> relative_centres(const Hull& hull, std::span<const Camera> cameras);

/// For each triangle the index of the view on whose cone it lies, -1: on none.
std::vector<std::int32_t> triangle_views(const Hull& hull);

/// Points inside the triangle \p a \p b \p c: \p count of them, spread evenly and the same each
/// time.
void spread_points(const Vec3f& a, const Vec3f& b, const Vec3f& c, int count,
                   std::vector<Vec3f>& points);

/// seen_fk of texture_hull.h, triangle-major. \p caster holds the hull alone, committed. What
/// lies outside a view's frame is not seen. With \p occlusion off, 1 for every triangle that faces
/// the view. \p rays counts what was cast.
std::vector<float> seen_shares(const Hull& hull, std::span<const Camera> cameras,
                               const RayCaster& caster, bool occlusion, int threads,
                               std::uint64_t& rays);

}  // namespace polyhull
