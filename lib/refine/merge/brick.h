// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Cells of marching cubes merged into boxes, within a brick of four cells along each axis: see
/// merged_cells.h.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "refine/cell_surface.h"

namespace polyhull::refine {

/// By how much the surface in a box may leave its plane, in cells, root mean square.
struct Flatness {
  float anywhere = 0.3f;
  float at_rims = 0.1f;  ///< where an outline is made
};

/// An edge of the grid from the node (x, y, z), counted from the brick's first: 0 to 4.
struct BrickEdge {
  int x = 0, y = 0, z = 0, axis = 0;
};

/// A cell with surface, or cells merged. Lengths are in cells, from the brick's first node.
struct CellBox {
  std::array<std::uint8_t, 3> low{}, size{1, 1, 1};
  std::array<std::int8_t, 2> parts{-1, -1};  ///< the boxes that were merged; -1: without surface
  bool merged = false;
  bool alive = true;  ///< not a part of another
  bool disc = true;   ///< its surface is one disc
  bool at_rim = false;
  // Of the surface within, by its triangles' areas and middles:
  float area = 0.0f;
  Vec3f sum{0.0f}, normal{0.0f};  ///< integrals of the place and of the unit normal
  float squares[6] = {};          ///< of xx, yy, zz, xy, yz, zx
  float gap = 0.0f;               ///< how far the surface lies outside its triangles, in the mean

  /// The faces of the box on which an edge lies, a bit each.
  unsigned faces_at(const BrickEdge& edge) const;
};

struct Brick {
  static constexpr int cells = 4, nodes = 5, none = 255;

  int x = 0, y = 0, z = 0;                ///< of the grid's bricks
  std::uint8_t signs[nodes][nodes] = {};  ///< of the rows of nodes (z, y): bit x: inside
  std::array<std::uint32_t, 8> above{},
      below{};                         ///< numbers of the bricks beside it: bit a: along axis a
  std::uint64_t active = 0, rims = 0;  ///< cells with surface, and with a rim: bit 16 z + 4 y + x
  std::uint64_t covered = 0;           ///< cells with surface, and those of merged boxes
  std::vector<CellBox> boxes;          ///< each merge takes a box or empty cell away: 127 at most
  std::array<std::uint8_t, 64> box_of{};     ///< of each cell with surface: the box that it lies in
  std::array<float, 192> along{};            ///< own edges' vertices: where on it, 0 to 1
  std::array<std::uint8_t, 192> number{};    ///< among its vertices; `none`: left out
  std::vector<Vec3f> points, normals;        ///< of its vertices; cells from the brick's first node
  std::vector<Vec3f> slid;                   ///< where the points move to
  std::vector<std::uint32_t> triangles;      ///< of vertices: 256 times the brick, and its number
  std::vector<std::uint16_t> triangle_ends;  ///< of each of the boxes

  static int cell_index(int x, int y, int z) { return 16 * z + 4 * y + x; }
  static int edge_index(const BrickEdge& e) {
    return 3 * ((e.z * nodes + e.y) * nodes + e.x) + e.axis;
  }
  static BrickEdge edge_at(int index) {
    const int node = index / 3;
    return {node % nodes, node / nodes % nodes, node / (nodes * nodes), index % 3};
  }
  /// Of an edge from one of the first four nodes along each axis.
  static int own_edge(const BrickEdge& e) { return 3 * cell_index(e.x, e.y, e.z) + e.axis; }

  bool inside(int i, int j, int k) const { return (signs[k][j] >> i & 1) != 0; }
  /// Which corners of a cell are inside, for the table.
  unsigned pattern(int i, int j, int k) const {
    return (signs[k][j] >> i & 3u) | (signs[k][j + 1] >> i & 3u) << 2 |
           (signs[k + 1][j] >> i & 3u) << 4 | (signs[k + 1][j + 1] >> i & 3u) << 6;
  }

  /// Where the surface crosses the edges, and its cells merged; `signs`, `active` and `rims` are set.
  void merge(const Level& fine, const Flatness& flatness);
  /// Takes box \p b apart again.
  void split(int b);
  /// The edges around the disc of \p box, in their order, as edge_index().
  void outline(const CellBox& box, std::vector<std::uint16_t>& edges) const;

 private:
  using Triple = std::array<int, 3>;
  /// Rows of nodes (a, b) for each axis: bit i: inside; the first along x of (z, y), then y of (z, x),
  /// then x of (y, z).
  using Rows = std::array<std::array<std::array<std::uint8_t, nodes>, nodes>, 3>;

  int alive_at(const Triple& low, const Triple& size) const;
  bool disc_again(const Rows& rows, const Triple& low, const Triple& size, int axis,
                  bool both) const;
  void try_merge(const Rows& rows, const CellBox& box, int axis, const Flatness& flatness);
  void add_cells(const std::array<float, 375>& crossings);
  void own(int b);
};

}  // namespace polyhull::refine
