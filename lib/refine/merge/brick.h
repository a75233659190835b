// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A brick of the grid, four cells along each axis, with its boxes: see merged_cells.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "refine/merge/moments.h"

namespace polyhull::refine {

/// An edge of the grid from the node (x, y, z), counted from the brick's first: 0 to 4.
struct BrickEdge {
  int x = 0, y = 0, z = 0, axis = 0;
};

/// A region of cells: lengths are in cells, from the brick's first node.
struct CellRegion {
  std::array<std::uint8_t, 3> low{}, size{1, 1, 1};

  bool operator==(const CellRegion&) const = default;
  bool is_cell() const { return size[0] == 1 && size[1] == 1 && size[2] == 1; }
  /// The faces of the region on which an edge lies, a bit each.
  unsigned faces_at(const BrickEdge& edge) const;
};

/// A cell with surface, or cells merged.
struct CellBox {
  CellRegion region;
  Moments surface;
  float gap = 0.0f;  ///< how far the surface lies outside its triangles, in the mean
  std::uint16_t outline_end = 0;
};

/// A vertex of marching cubes around which three boxes meet; lengths are as CellRegion's.
struct BrickCorner {
  BrickEdge edge;
  Vec3f point{0.0f}, normal{0.0f};
  Vec3f slid{0.0f};  ///< where the point moves to
};

struct Brick {
  static constexpr int cells = 4, nodes = 5, none = 255;

  int x = 0, y = 0, z = 0;                ///< of the grid's bricks
  std::uint8_t signs[nodes][nodes] = {};  ///< of the rows of nodes (z, y): bit x: inside
  std::array<std::uint32_t, 8> above{},
      below{};                         ///< numbers of the bricks beside it: bit a: along axis a
  std::uint64_t active = 0, rims = 0;  ///< cells with surface, and with a rim: bit 16 z + 4 y + x
  std::vector<CellRegion> refused;     ///< no boxes
  std::vector<CellBox> boxes;
  std::vector<std::uint16_t> outlines;     ///< the edges around each box of several cells, in their
                                           ///< order, as edge_index()
  std::array<std::uint8_t, 64> box_of{};   ///< of each cell with surface: the box that it lies in
  std::array<float, 192> along{};          ///< own edges' vertices: where on it, 0 to 1
  std::array<std::uint8_t, 192> number{};  ///< among its corners; `none`: left out
  std::vector<BrickCorner> corners;        ///< those on its own edges
  std::vector<std::uint32_t> triangles;    ///< of vertices: 256 times the brick, and its number
  std::vector<std::uint16_t> triangle_ends;  ///< of each of the boxes
  std::vector<std::uint32_t> turned;         ///< corners of those that a slide turns over

  static int cell_index(int x, int y, int z) { return 16 * z + 4 * y + x; }
  static int edge_index(const BrickEdge& e) {
    return 3 * ((e.z * nodes + e.y) * nodes + e.x) + e.axis;
  }
  static const BrickEdge& edge_at(int index);
  /// Of an edge from one of the first four nodes along each axis.
  static int own_edge(const BrickEdge& e) { return 3 * cell_index(e.x, e.y, e.z) + e.axis; }

  bool inside(int i, int j, int k) const { return (signs[k][j] >> i & 1) != 0; }
  /// Which corners of a cell are inside, for the table.
  unsigned pattern(int i, int j, int k) const {
    return (signs[k][j] >> i & 3u) | (signs[k][j + 1] >> i & 3u) << 2 |
           (signs[k + 1][j] >> i & 3u) << 4 | (signs[k + 1][j + 1] >> i & 3u) << 6;
  }
  /// The edges around box \p b.
  std::span<const std::uint16_t> outline(std::size_t b) const {
    const std::size_t begin = b == 0 ? 0 : boxes[b - 1].outline_end;
    return std::span(outlines).subspan(begin, boxes[b].outline_end - begin);
  }
};

}  // namespace polyhull::refine
