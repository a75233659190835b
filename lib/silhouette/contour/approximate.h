// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Polygons with few vertices within a guaranteed distance of traced rings.
///
/// Each ring is cut into runs that a straight line fits within the tolerance ε; each run gets its
/// least-squares line, neighbouring lines are intersected, and the result is kept only where every
/// traced point of a run lies within ε of its edge and every point of the edge within ε of the run:
/// then the Hausdorff distance between polygon and traced ring is at most ε. A least-squares line
/// runs through the middle of its points, so the shape neither shrinks nor grows (chords of a
/// convex arc all lie inside); where the tolerance holds a corner back, at tips above all, the
/// other corners give the ring its area back. Finally edges that would cross are found, and their
/// runs refined, until no two edges of any rings meet.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/rings.h"

namespace polyhull {

struct ApproximateSettings {
  double tolerance = 1.0;      ///< px, 0..100; 0: the traced rings as they are
  int min_edges = 4;           ///< rings with fewer edges are dropped, 3..1000 (thesis 3.5.2)
  double min_area = 16.0;      ///< px²; smaller outer rings are dropped with what they contain
  double min_hole_area = 0.0;  ///< px²; smaller holes are filled
  int keep_largest = 0;        ///< only this many outer rings, the largest, are kept; 0: all
  bool operator==(const ApproximateSettings&) const = default;
};

/// A corner of an approximated ring, and the traced point where its run begins.
struct RingNode {
  std::uint32_t point = 0;  ///< index into the traced rings' points
  Vec2f vertex{0.0f};
  bool run = true;  ///< to be kept, too: the edge from here to the next corner
};

/// Of the last call.
struct ApproximateCounts {
  std::uint32_t traced_points = 0;
  std::uint32_t traced_rings = 0;
  std::uint32_t points = 0;
  std::uint32_t rings = 0;
  std::uint32_t dropped_rings = 0;  ///< by min_edges, min_area, min_hole_area, keep_largest
  std::uint32_t crossings = 0;      ///< pairs of edges that crossed and were refined
};

/// Keeps its working memory between frames.
class Approximator {
 public:
  Approximator();
  ~Approximator();
  Approximator(Approximator&&) noexcept;
  Approximator& operator=(Approximator&&) noexcept;

  /// \p parents: what Tracer::trace() gave (found here where it is not one for each ring). Vertices
  /// are multiples of 1/512 px. \p nodes, by their points: corners to be kept, where they are within
  /// the tolerance; a ring that has any begins with one. False: edges meet all the same, as the traced
  /// rings do there. Throws Error (bad_input) for settings out of range.
  bool approximate(const Rings& traced, std::span<const std::int32_t> parents,
                   const ApproximateSettings& settings, Rings& rings,
                   std::span<const RingNode> nodes = {});
  const ApproximateCounts& counts() const;

  /// The corners of the last call's rings, by their points; none with tolerance 0.
  std::span<const RingNode> nodes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace polyhull
