// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which triangles are in a cell, by its corners inside: see cell_surface.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace polyhull::refine {

/// An edge of a cell: from the corner (x, y, z) along an axis.
struct CellEdge {
  int x = 0, y = 0, z = 0;
  int axis = 0;
};

/// The table of all 256 cases, made once. Corner k lies at (k & 1, k >> 1 & 1, k >> 2).
class CellTable {
 public:
  CellTable();
  /// Three edges to a triangle, outside seen counter-clockwise; bit k of \p corners: corner k is
  /// inside.
  std::span<const std::uint8_t> triangles(unsigned corners) const { return triangles_[corners]; }
  const CellEdge& edge(std::uint8_t index) const { return edges_[index]; }

 private:
  std::array<CellEdge, 12> edges_{};
  std::array<std::vector<std::uint8_t>, 256> triangles_;
};

const CellTable& cell_table();

}  // namespace polyhull::refine
