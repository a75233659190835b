// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The constrained Delaunay triangulation of one face.
///
/// The loops are triangulated in the plane, by the coordinates that the vertices have after
/// rounding to float, dropped along the face normal's largest axis: a triangle that runs the right
/// way round there cannot be flipped. Holes are joined to their outer loops by bridges, ears are
/// cut off, and inner edges are flipped (Lawson 1977) until each is locally Delaunay, measured in
/// the face's own plane. Where slivers or turned triangles are left, PatchOptimizer looks for
/// better.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_set>
#include <vector>

#include "base/vector.h"
#include "hull/surface/patch_optimizer.h"

namespace polyhull::hull {

class Triangulator {
 public:
  /// Appends the triangles of the face to \p triangles. \p loops: vertex numbers, loop k is
  /// [ends[k-1], ends[k]) of them counted from first; outer loops counter-clockwise seen against
  /// \p normal (out of the solid), holes clockwise.
  void triangulate(std::span<const Vec3f> vertices, std::span<const CornerKey> keys,
                   std::span<const std::uint32_t> loops, std::span<const std::uint32_t> ends,
                   std::uint32_t first, const Vec3& normal, std::vector<std::uint32_t>& triangles);

 private:
  struct Node {
    std::uint32_t vertex, previous, next;
    /// Of the edge to the next node: none on the border, else the half-edge beyond it, or for a
    /// bridge that has no triangle yet `bridge` plus the node of its other side.
    std::uint32_t beyond;
  };
  /// A loop as join_holes() sees it.
  struct Loop {
    double area, perimeter;
    std::uint32_t rightmost, owner;  ///< node; the loop that it has become a part of
    bool hole, joined;
  };
  double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;  // of local points
  bool allowed(std::uint32_t a, std::uint32_t b) const;                  ///< as an inner edge
  void find_holes();
  std::uint32_t bridge_end(const Vec2& p) const;
  void build_bridge(std::uint32_t m, std::uint32_t end);
  void join_holes();
  bool cut_loops(std::span<const std::uint32_t> ends, std::uint32_t first);
  bool cut_ears(std::uint32_t start, std::uint32_t count);
  void add_triangle(std::uint32_t first, std::uint32_t second, std::uint32_t third);
  void join_side(std::uint32_t node, std::uint32_t half_edge);
  bool ear(std::uint32_t node, bool loose) const;
  void flip_edges();
  bool worse(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const;

  std::vector<Vec2> flat_;    ///< dropped along an axis, counter-clockwise from outside
  std::vector<Vec2> metric_;  ///< in the face's plane, true lengths
  std::vector<Vec3> points_;  ///< against the first
  std::vector<CornerKey> local_keys_;
  PatchOptimizer optimizer_;
  std::vector<std::uint32_t> number_;
  double rounding_ = 0.0;                   ///< bound of the error of the vertices' coordinates
  bool careful_ = false;                    ///< the loops overlap by rounding
  std::unordered_set<std::uint64_t> used_;  ///< edges, if careful
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> starts_, counts_;
  std::vector<std::uint32_t> local_;     ///< triangles by local points
  std::vector<std::uint32_t> opposite_;  ///< half-edge numbers; none on the border
  std::vector<std::uint32_t> stack_;
  std::vector<Loop> loops_;
  std::vector<std::uint32_t> holes_, loop_of_;
};

}  // namespace polyhull::hull
