// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The surface where a function on a grid is 0, as triangles: marching cubes (Lorensen and Cline
/// 1987) with a table made so that the surface is always a closed 2-manifold.
///
/// On a face of a cell with inside corners across a diagonal the inside corners are kept apart, the
/// same from both cells, so that neighbours always agree. In a cell the crossed edges form loops;
/// each is cut into triangles without a diagonal between two edges of one face of the cell, which
/// a neighbour could have, too. Vertices lie on the grid's edges, never at their ends: triangles
/// of different cells share no more than a face of both, and those of a cell keep to their corners,
/// so none cross.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "refine/field/contact_rays.h"

namespace polyhull::refine {

struct CellSurface {
  std::vector<Vec3f> points;
  std::vector<Vec3f> normals;            ///< unit, towards where the function falls
  std::vector<std::uint32_t> triangles;  ///< outside seen counter-clockwise

  void clear() {
    points.clear();
    normals.clear();
    triangles.clear();
  }
};

/// How near to a node a vertex may come, in cells.
inline constexpr float nearest_to_node = 0.01f;

/// Where on an edge, 0 to 1, the surface crosses it, by the function at its ends.
inline float crossing(float begin, float end) {
  return std::clamp(begin / (begin - end), nearest_to_node, 1.0f - nearest_to_node);
}

/// Which nodes are inside: bit x % 64 of word x / 64 of a row.
struct Signs {
  std::size_t words = 0;  ///< of a row
  std::vector<std::uint64_t> bits;

  /// Of \p fine, whose rows are whole eights (grid_over()); inside is f > \p above.
  void find(const Level& fine, float above, int threads);
  /// Row (y, z); beyond the grid its last one.
  const std::uint64_t* row(const Grid& grid, int y, int z) const {
    const int at = std::min(z, grid.nz - 1) * grid.ny + std::min(y, grid.ny - 1);
    return bits.data() + static_cast<std::size_t>(at) * words;
  }
};

/// Each bit's neighbour towards larger x in a row of \p words.
inline std::uint64_t next_bits(const std::uint64_t* row, std::size_t word, std::size_t words) {
  return row[word] >> 1 | (word + 1 < words ? row[word + 1] << 63 : 0);
}

/// Unit, towards where \p f falls, at the vertex \p along the edge from node (x, y, z).
Vec3f surface_normal(const Grid& grid, const float* f, int x, int y, int z, int axis, float along);

/// Finds surfaces and keeps the memory.
class CellMarcher {
 public:
  /// Appends the surface of \p fine, whose rows are whole eights (grid_over()), to \p out. The order
  /// of vertices and triangles follows the grid.
  void march(const Level& fine, CellSurface& out, int threads);

 private:
  struct Slab {
    std::vector<Vec3f> points, normals;
    std::vector<std::uint32_t> triangles;
    std::uint32_t first_vertex = 0;
  };
  void gather(CellSurface& out, const Grid& grid, int threads);
  /// The vertex on the edge from node (x, y, z) along \p axis.
  void add_vertex(const Level& fine, int x, int y, int z, int axis);
  void find_vertices(const Level& fine, int z);
  void find_triangles(const Level& fine, int z);

  std::vector<Slab> slabs_;
  Signs signs_;
  /// Of each node with a crossed edge: the number in its slab of its first edge's vertex, times
  /// eight, and which of its edges are crossed, one bit an axis.
  std::vector<std::uint32_t> vertices_of_node_;
};

}  // namespace polyhull::refine
