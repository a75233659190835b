// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A stage and the figure at several places of it: what cameras are judged by. Metres, y up, the
/// middle of the floor is the origin; azimuths are degrees from +z towards +x, as everywhere in the
/// studio.
#pragma once

#include <cstdint>
#include <vector>

#include "base/picture.h"
#include "base/vector.h"
#include "rig/rig.h"
#include "studio/plan/surface.h"

namespace polyhull {

/// The box in which the figure moves.
struct Stage {
  double width = 2.4;   ///< x
  double depth = 2.4;   ///< z
  double height = 2.3;  ///< y
  Vec3 middle() const { return {0.0, 0.5 * height, 0.0}; }
  Bounds bounds() const;
};

/// The figure somewhere on the stage.
struct StageBody {
  std::vector<Vec3f> positions;
  std::vector<Vec3f> normals;  ///< unit length, outward
  std::vector<std::uint32_t> triangles;
  TriangleSurface surface() const;
};

/// The figure at five instants of its motion, turned by fifths of a circle: three times in the
/// middle, where people mostly are, and towards two corners, as far as the box holds it, or a share
/// \p spread of that way. Throws Error (bad_input), with the size that would do, where the stage
/// does not hold it.
std::vector<StageBody> stage_bodies(const Stage& stage, double spread = 1.0);

/// Whether \p camera has the whole body in its picture.
bool holds(const Camera& camera, const StageBody& body);

/// The largest of 1, 3/4, 1/2, 1/4 and 0 with which \p cameras all have all bodies whole in their
/// pictures; 0 also where they never do.
double spread_for(const std::vector<Camera>& cameras, const Stage& stage);

/// The rig with its stage, the bounds, moved to the origin and in metres. Throws Error (bad_input)
/// where the rig has no bounds.
struct StagedRig {
  std::vector<Camera> cameras;
  Stage stage;
  /// Back to the rig's world: linear * x + origin, linear a rotation times a scale.
  Mat3 linear{1.0};
  Vec3 origin{0.0};
};
StagedRig staged_rig(const Rig& rig);

/// Where \p camera stands around the stage: degrees, 0 to 360, and metres from the stage's axis.
double azimuth_of(const Camera& camera);
double distance_of(const Camera& camera);

/// \p like at \p centre, upright, turned to \p target.
Camera aimed(const Camera& like, const Vec3& centre, const Vec3& target);

/// \p cameras with smaller pictures, by the least whole factor that leaves no side longer than
/// \p longest_side px: they say almost as much about outlines.
std::vector<Camera> coarse(std::vector<Camera> cameras, int longest_side);

/// What \p camera sees of triangles: 0..255 by coverage, one channel.
Picture coverage_of(const std::vector<Vec3f>& positions,
                    const std::vector<std::uint32_t>& triangles, const Camera& camera);

}  // namespace polyhull
