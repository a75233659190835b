// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The exact polyhedral visual hull of a set of silhouettes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "hull/hull.h"

namespace polyhull {

/// Counts and times (seconds) of one call, for `stats`.
struct HullStatistics {
  std::uint32_t cameras = 0;           ///< with a silhouette that is not empty
  std::uint32_t contour_vertices = 0;  ///< of all silhouettes
  std::uint64_t predicates = 0;
  std::uint64_t exact_predicates = 0;  ///< that the floating-point filter could not decide
  std::uint64_t inconsistencies = 0;   ///< decisions that contradicted each other: always 0
  bool reused = false;  ///< silhouettes and options were the last call's: so is the hull
  /// Cleaning, rays and grids of what has changed; working volume and planes by number; clipping of
  /// the faces; vertices; triangles.
  double seconds_prepare = 0, seconds_scene = 0, seconds_faces = 0, seconds_assemble = 0,
         seconds_triangulate = 0;
};

/// Builds hulls and keeps what can be reused from one call to the next (memory, cones, the last
/// result). One object per stream; not for use by two threads at once.
class HullBuilder {
 public:
  HullBuilder();
  ~HullBuilder();
  HullBuilder(HullBuilder&&) noexcept;
  HullBuilder& operator=(HullBuilder&&) noexcept;

  /// The intersection of the silhouettes' cones (and the bounds). The result is valid until the
  /// next call. An empty silhouette in any camera gives an empty hull under Unseen::carve, and so
  /// does a call without silhouettes.
  ///
  /// What exactly is intersected: rays are rounded to about 2^-38 of their length and centres to
  /// 2^-33 of the rig's size; of those the hull is exact. Rings that cross, touch or come nearer
  /// than 1e-6 px are cleaned first by the even-odd rule, on a grid of 2^-12 px (clean_region.h).
  /// Views from the same centre become one cone. Parts that touch in a point or an edge are apart:
  /// each has vertices of its own. Where faces coincide, the earlier camera's (in an order that
  /// only depends on calibrations and contours) is kept.
  ///
  /// Without bounds the hull is limited to a cube around the cameras' centres, 1024 times as far
  /// away as the furthest centre is from their middle (1024 units if all centres are one): cones
  /// that never close, as those of a single camera, end there, on faces with view -1. Cameras close
  /// together that look at something far away should come with bounds.
  ///
  /// Under Unseen::keep the frame's border carves too; its four edges have the numbers
  /// Rings::points.size() + 0..3 (top, right, bottom, left).
  ///
  /// Triangles that rounding to float would flatten or turn are mended by moving vertices by less
  /// than 2^-21 of the largest coordinate, and whole parts smaller than that are dropped if they
  /// have such triangles; none was left in any scene tried. With max_deviation the slivers go too,
  /// and faces may then leave their planes by that much; triangles do not come to cross by it.
  ///
  /// Bounds without volume give an empty hull, too.
  ///
  /// Throws Error (bad_input) when a camera or a contour is not finite or degenerate, when a
  /// camera's two focal lengths differ more than a million times, when Unseen::keep comes without
  /// bounds, when bounds are not finite or turned inside out, when max_deviation is not 0 or more,
  /// or when cameras or bounds are 1e35 units apart; Error (unsupported) when a contour reaches so
  /// far to the side that its rays hardly tell its pixels apart (with a focal length of 1,000 px
  /// that is some 15 million px away), or when its rings cannot be made simple.
  const Hull& build(std::span<const Silhouette> silhouettes, const HullOptions& options = {});

  const HullStatistics& statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
