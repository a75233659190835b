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

/// The surface on a face of a cell: from one crossed edge to another, as it runs around the cell's loop.
struct FaceStep {
  std::uint8_t from = 0, to = 0;
  std::uint8_t face = 0;
};

/// The table of all 256 cases, made once. Corner k lies at (k & 1, k >> 1 & 1, k >> 2); faces are
/// those of low x, high x, low y, high y, low z and high z.
class CellTable {
 public:
  CellTable();
  /// Around each piece of the surface, one after the other.
  std::span<const FaceStep> steps(unsigned corners) const { return steps_[corners]; }
  /// Of how many pieces the surface in the cell is.
  int loops(unsigned corners) const { return loops_[corners]; }
  /// Three edges to a triangle, outside seen counter-clockwise; bit k of \p corners: corner k is
  /// inside.
  std::span<const std::uint8_t> triangles(unsigned corners) const { return triangles_[corners]; }
  const CellEdge& edge(std::uint8_t index) const { return edges_[index]; }

 private:
  std::array<CellEdge, 12> edges_{};
  std::array<std::vector<FaceStep>, 256> steps_;
  std::array<std::uint8_t, 256> loops_{};
  std::array<std::vector<std::uint8_t>, 256> triangles_;
};

const CellTable& cell_table();

}  // namespace polyhull::refine
