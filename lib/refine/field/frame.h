// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The refiner's frame: cells of the middle grid from the middle of the hull, the hull's longest side
/// along x, which makes the grids' rows long. All numbers of the refiner are in it, so that nothing
/// depends on the cell.
#pragma once

#include "hull/hull.h"
#include "refine/field/contact_rays.h"
#include "refine/field/hull_distance.h"

namespace polyhull::refine {

struct LocalFrame {
  Vec3 origin{0.0};    ///< world units
  double cells = 1.0;  ///< in a world unit
  int x_axis = 0;      ///< the world's axis that is x; the next ones follow in turn

  Vec3f from_world(const Vec3& point) const {
    const Vec3 p = (point - origin) * cells;
    return {p[x_axis], p[(x_axis + 1) % 3], p[(x_axis + 2) % 3]};
  }
  /// A direction in the world.
  Vec3 turned_back(const Vec3& local) const {
    Vec3 out;
    for (int k = 0; k < 3; ++k) out[(x_axis + k) % 3] = local[k];
    return out;
  }
};

/// The frame of \p hull; Throws Error where its vertices are not finite.
LocalFrame frame_of(const Hull& hull, double cells_per_unit);

/// \p camera in \p frame, without its silhouette's maps.
ContactView view_in(const LocalFrame& frame, const Camera& camera);

/// \p rings (pinhole pixels of \p camera) for trace_rays().
OutlineView outline_in(const LocalFrame& frame, const Camera& camera, const Rings& rings,
                       float spacing);

/// A connected part of a hull, or several whose boxes are near each other.
struct Box {
  Vec3f low, high;
};

/// The boxes of \p hull's connected parts; those that come nearer than \p margin (along x
/// and the eight nodes by which grid_over() may reach further) are one.
std::vector<Box> boxes_of(const Hull& hull, const LocalFrame& frame, float margin);

/// Where the hull ends at its bounds.
Box bounds_of(const Hull& hull, const LocalFrame& frame);

}  // namespace polyhull::refine
