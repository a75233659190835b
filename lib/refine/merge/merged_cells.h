// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The surface where a function on a grid is 0, with triangles as large as its bends allow: marching
/// cubes whose cells are merged into boxes, as long as the surface in a box is one almost flat disc.
///
/// Marching cubes cuts the surface into a loop of crossed edges for each cell (cell_surface.h). A cube of
/// four cells a side, and where that fails one of two, becomes a box when
///
///   1. the surface in it is a disc: each cell's is one, the faces of the cube have one outline, no line
///      of nodes along the surface's main axis is crossed twice, so no part of it is closed, and
///      vertices - edges + faces = 1;
///   2. no edge of the cube is crossed twice, and some are crossed;
///   3. it leaves its mean plane by little (Flatness).
///
/// Then boxes side by side, of one size, are merged when the surface of each is a disc, that on the
/// rectangle between them is one arc, so both together are a disc again, and 2 and 3 hold.
///
/// Each box becomes one polygon. Its corners are the vertices of marching cubes around which three
/// boxes meet at least; all others are left out, and what ran through them on a face of the box runs
/// straight. By 2 each side of the rectangle where two boxes touch is crossed once at most. So the
/// lines on it join different sides, and as the arcs that they replace do not cross each other,
/// neither do they; nor do two polygons share more than one line. The crossed edges of a box are corners, three at
/// least. So the polygons make a closed 2-manifold as the loops did. They are cut into triangles within their
/// boxes (polygon.h), which touch in their faces alone, so none cross. A box whose polygon cannot be cut so is taken
/// apart again.
///
/// Flat polygons with their corners on a convex surface lie inside of it. So the corners slide along
/// the grid's edges, where they stay corners, outwards by the mean gap of the boxes around, but where
/// that would turn a triangle over.
///
/// Boxes keep to bricks of four cells along each axis, so bricks are merged by themselves, on any
/// number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include "refine/field/cell_surface.h"
#include "refine/merge/brick_merger.h"

namespace polyhull::refine {

/// Finds surfaces and keeps the memory.
class CellMerger {
 public:
  /// Appends the surface of \p fine, whose rows are whole eights (grid_over()) and which is outside at
  /// the grid's border, to \p out. \p rays
  /// of \p part have their rims (find_rims()). The order of vertices and triangles follows the grid.
  void march(const Level& fine, const ContactRays& rays, std::uint32_t part,
             const Flatness& flatness, CellSurface& out, int threads);

 private:
  using Numbers = std::vector<std::uint32_t>;

  void find_bricks(const Level& fine, int threads);
  void search(const Grid& grid, int z, std::vector<std::int32_t>& found) const;
  void fill(const Grid& grid, Brick& brick) const;
  void mark_rims(const Grid& grid, const ContactRays& rays, std::uint32_t part);
  std::int32_t brick_at(int x, int y, int z) const;
  std::uint32_t vertex(const Brick& brick, const BrickEdge& edge) const;
  Vec3f point(const Brick& brick, Vec3f BrickCorner::*point, std::uint32_t vertex) const;
  /// A number for the box that cell (x, y, z) of \p brick lies in, -1 to 3 along each axis.
  std::uint32_t box_at(const Brick& brick, int x, int y, int z) const;
  void around(const Brick& brick, const BrickEdge& edge, std::uint32_t (&boxes)[4]) const;

  void find_corners(const Level& fine, Brick& brick) const;
  bool cut(Brick& brick) const;
  float gap(const Brick& brick, const CellBox& box, std::size_t first) const;
  void slide(Brick& brick) const;
  void find_turned(Brick& brick) const;
  void take_back(const Numbers& all, int threads);
  /// Calls body(brick, its number) for some bricks, on some threads.
  template <typename Body>
  void each(const Numbers& some, int threads, const Body& body);
  /// The bricks that are \p first to \p last bricks from those of \p some, along each axis.
  Numbers near(const Numbers& some, int first, int last) const;
  void gather(const Level& fine, CellSurface& out, int threads) const;

  int nx_ = 0, ny_ = 0, nz_ = 0;    ///< bricks
  std::vector<std::int32_t> grid_;  ///< the number of each brick; -1: without surface
  std::vector<Brick> bricks_;       ///< the first count_
  std::uint32_t count_ = 0;
  Signs signs_;
  std::vector<std::vector<std::int32_t>> layers_;  ///< places in grid_ of the bricks with surface
};

}  // namespace polyhull::refine
