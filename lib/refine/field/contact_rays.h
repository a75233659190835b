// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Rays that touch the body: each ray through a point of a silhouette's outline touches it at one
/// place at least, its rim point, where the surface's normal is that of the cone's plane.
///
/// Where on the ray, the silhouettes leave open: the ray's pieces on the hull. With a function f on
/// a grid, positive inside the surface, the rim is where f is largest on all pieces of the ray. One
/// contact is all that a ray needs, so what lies behind T-junctions, hidden rims and phantom
/// volumes settle ray by ray.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rings.h"
#include "refine/field/grid.h"
#include "refine/loops/loops.h"
#include "rig/camera.h"

namespace polyhull::refine {

/// A part of the hull on a grid of its own.
struct Level {
  Grid grid;
  std::vector<float> hull;    ///< H at the nodes (hull_distance.h)
  std::vector<float> values;  ///< f: the surface is where it is 0
  std::vector<Extent> rows;   ///< of row (y, z) at z * ny + y: f is `outside` beyond
};

/// Calls body(nodes) for the stretches of row \p r of \p level, whole eights, that may have nodes
/// where H > \p above.
template <typename Body>
void each_stretch(const Level& level, std::size_t r, float above, const Body& body) {
  const float* hull = level.hull.data() + r * level.grid.row();
  const Extent row = level.rows[r];
  Extent stretch;
  for (int x = row.begin / 8 * 8; x < row.end; x += 8) {
    bool any = false;
    for (int k = 0; k < 8; ++k) any |= hull[x + k] > above;
    if (any) {
      stretch.include({x, x + 8});
    } else if (stretch.begin < stretch.end) {
      body(stretch);
      stretch = {};
    }
  }
  if (stretch.begin < stretch.end) body(stretch);
}

/// sample() of \p values on \p grid at some nodes of row (y, z) of the grid \p at; \p mixed is worked
/// with.
void sample_row(const Grid& grid, const float* values, const Grid& at, int y, int z, Extent nodes,
                std::vector<float>& mixed, float* out);

struct ContactRay {
  Vec3f origin{0.0f};
  Vec3f direction{0.0f};  ///< along it for a depth of 1
  Vec3f normal{0.0f};     ///< of the cone's plane, unit, out of the cone
  std::uint32_t first_piece = 0, end_piece = 0;
  // The rim as it was found last:
  std::uint32_t part = 0;
  float depth = 0.0f;
  float value = outside;  ///< f there

  Vec3f point(float at) const { return origin + at * direction; }
  Vec3f rim() const { return point(depth); }
};

/// The depths between which \p ray is in \p grid's box; false: none.
bool clip(const ContactRay& ray, const Grid& grid, float& from, float& to);

/// From depth \p begin to \p end the ray lies on the hull, or a little outside, in a part's grid.
struct RayPiece {
  float begin = 0.0f, end = 0.0f;
  std::uint32_t part = 0;
};

struct ContactRays {
  std::vector<ContactRay> rays;
  std::vector<RayPiece> pieces;
};

/// Points of an outline in a view, ready to become rays in the refiner's frame.
struct OutlineView {
  const Rings* rings = nullptr;  ///< pinhole pixels
  Vec3f centre{0.0f};
  Mat3 ray{1.0};         ///< from a homogeneous pixel to the ray's direction at depth 1
  float spacing = 3.0f;  ///< pixels between rays
};

/// The rays of \p views with their pieces on the hull of \p parts (Level::hull), which are found
/// in steps of a cell; rays without a piece are left out. The order follows views and outlines.
void trace_rays(std::span<const OutlineView> views, std::span<const Level> parts, int threads,
                ContactRays& out);

/// Where rims are looked for.
enum class RimSearch {
  everywhere,  ///< on all pieces
  near,        ///< uphill from the last rim, three steps at most
};

/// Finds the rim of every ray (of each \p stride-th one) by Level::values, in steps of \p step of
/// depth; those of rays whose last f was \p held or more stay.
void find_rims(ContactRays& rays, std::span<const Level> parts, float step, RimSearch where,
               std::size_t stride, int threads, float held = 1e9f);

}  // namespace polyhull::refine
