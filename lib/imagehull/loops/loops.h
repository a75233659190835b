// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What each ray costs of image_hull.h, compiled once per instruction set (loops.inc) and chosen at
/// run time. The results are the same to the bit: plain C++ without contraction, vectorised by the
/// compiler.
///
/// A ray o + s d is seen by a view as a straight line: with H from the world to the view's homogeneous
/// pixels, o' = H (o - c) and d' = H d, its image has the coordinates l = o' x d'. An edge from a to b
/// of the silhouette is crossed where l a and l b differ in sign; its plane (n, the edge's line) is met
/// at 1/s = - n d' / n o'. Both are linear in d, and a vertex has the same l a for both its edges: rays
/// never slip between edges.
#pragma once

#include <cstdint>

#include "base/instruction_set.h"

namespace polyhull::imagehull {

inline constexpr int lanes = 16;       ///< rays asked at once
inline constexpr int chain_edges = 4;  ///< edges under one box

/// A view's silhouette: its edges in chains that follow each other along the rings. What a ring lacks
/// of a whole chain its last vertex repeats.
struct Chains {
  int count = 0;
  const float* middle_x = nullptr;  ///< of the chains' boxes, pixels from the silhouette's middle
  const float* middle_y = nullptr;
  const float* half_x = nullptr;  ///< half the boxes' sides, and a little more
  const float* half_y = nullptr;
  const float* points = nullptr;  ///< by chain: chain_edges + 1 times x, then as many times y
  const std::uint32_t* first_edge = nullptr;  ///< by chain
};

/// Directions d of rays that share their origin, world.
struct Directions {
  float x[lanes], y[lanes], z[lanes];
};

/// What of a list of crossings is a view's.
struct ViewCrossings {
  int begin = 0, end = 0;
  int inside = 0;  ///< 1: the rays' origin lies in the view's cone
};

struct Loops {
  /// Writes the numbers of the chains that rays from \p start (o') may cross whose directions (d') lie
  /// between the four of \p corners; \p chains has room for all. Returns how many.
  int (*gather)(const Chains& view, const float* start, const float (*corners)[3],
                std::uint32_t* chains);
  /// Writes 1/s (lanes numbers; 0: not crossed) and the edge of each edge that any of the rays
  /// crosses, of \p count chains; \p turn are H's rows. There is room for all edges of these.
  int (*cross)(const Chains& view, const std::uint32_t* chains, int count, const float* start,
               const float* turn, const Directions& rays, float* inverse, std::uint32_t* edges);
  /// 1/s and the edge where each ray first enters what is inside all views beyond \p near (1/s,
  /// infinity: from the origin on); 0 where it never does.
  void (*enter)(const ViewCrossings* views, int count, const float* inverse,
                const std::uint32_t* edges, const float* near, float* entry, std::uint32_t* edge);

  static const Loops& baseline();
  static const Loops& avx2();
  static const Loops& best() { return best_loops<Loops>(); }
};

}  // namespace polyhull::imagehull
