// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The best triangulation of small parts of a face, by dynamic programming.
///
/// A Delaunay triangulation has the largest smallest angle, which is not the fewest slivers, and
/// where rounding to float has made a polygon cross itself it may have to turn a triangle that
/// another triangulation would not. Around each bad triangle a patch is gathered whose border is a
/// simple loop of its vertices v_0 ... v_n-1; among all triangulations of that loop the best is
/// found in O(n^3) (Klincsek 1980):
///   cost(i, j) = min over i < k < j of cost(i, k) + cost(k, j) + triangle(i, k, j),
/// costs being ordered by triangles that are turned by more than rounding, flat ones (which the
/// simplifier can mend), slivers, and last the sum of longest edge over height. No test for
/// crossing diagonals is needed: a triangulation of a simple polygon's loop whose triangles all run
/// the right way round covers each of its points once.
///
/// A patch that is mended costs what lies in it, not what the face holds. All triangles are gone
/// through again until nothing changes.
///
/// Corners that may not be joined by any edge (see may_join) are joined here by edges that have the
/// face's inside clearly on both sides: good triangles, higher than any rounding. On another face
/// there cannot be such an edge, too, for the faces would cross.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hull/faces/face_clipper.h"
#include "hull/surface/edge_counts.h"
#include "hull/surface/half_edge.h"
#include "hull/surface/triangle_shape.h"

namespace polyhull::hull {

/// Whether two corners may be joined by any edge inside a face. Corners with two planes in common
/// lie on the line of both, so where rounding has left no room between them the other face could
/// have the same edge, which must not be. An apex lies on all planes of its ring.
bool may_join(const CornerKey& a, const CornerKey& b);

class PatchOptimizer {
 public:
  /// Triangulates anew around the bad ones of \p triangles (three indices each into \p points and
  /// \p keys), which must be one face's, with the unit normal \p normal. Coordinates are off by
  /// \p rounding at most. Triangles stay as many.
  void improve(std::span<const Vec3> points, std::span<const CornerKey> keys, const Vec3& normal,
               double rounding, std::span<std::uint32_t> triangles);

  /// Of the last call: half-edges that were joined with what lies beyond them, and triangles that
  /// were looked at.
  std::uint64_t joined_half_edges() const { return joined_half_edges_; }
  std::uint64_t seen_triangles() const { return seen_triangles_; }

 private:
  struct Cost {
    /// 2^20 for each turned triangle, 2^10 for each flat one, 1 for each sliver.
    std::uint32_t bad = 0;
    double length = 0.0;
    bool operator<(const Cost& o) const { return bad != o.bad ? bad < o.bad : length < o.length; }
    Cost operator+(const Cost& o) const { return {bad + o.bad, length + o.length}; }
  };
  enum Side : char {
    free_side,   ///< any edge
    clear_side,  ///< an edge of clear triangles only
    taken_side   ///< no edge
  };
  Cost cost(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  Cost cost_of(std::uint32_t triangle) const;
  bool clear(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  void connect();
  void connect_patch();
  void count_patch(int sign);
  void gather(std::uint32_t triangle);
  void find_sides();
  bool solve();

  std::span<const Vec3> points_;
  std::span<const CornerKey> keys_;
  Vec3 normal_{0.0};
  double rounding_ = 0.0;
  std::span<std::uint32_t> triangles_;
  HalfEdges mesh_;                       ///< of triangles_ and opposite_
  std::vector<std::uint64_t> sorted_;    ///< half-edges by their two vertices
  std::vector<std::uint32_t> opposite_;  ///< half-edge numbers
  std::uint64_t joined_half_edges_ = 0, seen_triangles_ = 0;
  bool tangled_ = false;  ///< three half-edges or more have the same two vertices
  bool counted_ = false;  ///< edges_ holds the face's edges
  EdgeCounts edges_;
  std::vector<std::uint32_t> patch_;        ///< triangles
  std::vector<std::uint32_t> loop_, side_;  ///< the patch's border: vertices, half-edges from each
  std::vector<std::uint32_t> beyond_;       ///< half-edges beyond the border
  std::vector<std::uint32_t> open_half_edges_;  ///< of connect_patch()
  std::vector<Side> sides_;                     ///< n x n
  std::vector<Cost> costs_;                     ///< n x n
  std::vector<std::uint32_t> middle_;           ///< n x n: the best k; none: unusable
  std::vector<std::uint32_t> result_;
  std::vector<std::pair<std::size_t, std::size_t>> open_;  ///< sides of the loop still to follow
};

}  // namespace polyhull::hull
