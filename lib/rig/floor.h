// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where a stage's floor is, and a world that stands on it.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

/// Whether all cameras look down by 5 degrees or more: nothing but bounds then ends a hull under
/// the feet of its subject.
bool looks_down(const Rig& rig);

/// The camera whose axes are the world's, as of a calibration that knows no floor: up is then only how
/// that camera is held. Null: there is none.
const Camera* world_camera(const Rig& rig);

/// The point nearest to the rays of \p seen (cameras of \p rig by number, pixels of their pictures),
/// in world units. Throws Error unless two cameras see it from different sides.
Vec3 triangulate(const Rig& rig, std::span<const std::pair<std::size_t, Vec2>> seen);

/// From one world to another: x' = R x + t.
struct Frame {
  Mat3 R{1.0};
  Vec3 t{0.0};
};

/// The frame in which \p points lie on the floor y = 0: the first is the origin, x points towards
/// the second, y up, to where the cameras \p centres are in the mean. The floor lies through the
/// first, its normal is the mean of those of all triangles with it, by area. Throws Error for fewer than three points, or points on a line.
Frame floor_frame(std::span<const Vec3> points, std::span<const Vec3> centres);

/// \p rig in the world of \p frame, whose y is up. Bounds, which are along the axes of the world that
/// was, are left out.
Rig moved_rig(const Rig& rig, const Frame& frame);

}  // namespace polyhull
