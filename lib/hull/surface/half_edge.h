// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Half-edges of a triangle mesh by number: those of triangle t are 3 t, 3 t + 1 and 3 t + 2, and
/// half-edge h begins at the vertex triangles[h].
#pragma once

#include <cstdint>
#include <span>

namespace polyhull::hull {

/// No half-edge, no vertex.
inline constexpr std::uint32_t none = 0xffffffffu;

/// The next half-edge around the same triangle, which begins where \p h ends.
inline std::uint32_t following(std::uint32_t h) {
  return h % 3 == 2 ? h - 2 : h + 1;
}

/// How a mesh hangs together; the memory is its user's.
struct HalfEdges {
  std::span<std::uint32_t> triangles;      ///< three vertices each
  std::span<std::uint32_t> opposite = {};  ///< of each half-edge the one beyond; none on a border
  std::span<std::uint32_t> leaving = {};  ///< of each vertex a half-edge that begins there, if kept

  std::uint32_t from(std::uint32_t h) const { return triangles[h]; }
  std::uint32_t to(std::uint32_t h) const { return triangles[following(h)]; }
  /// The corner across from \p h.
  std::uint32_t apex(std::uint32_t h) const { return triangles[following(following(h))]; }
  /// The next half-edge that leaves the same vertex.
  std::uint32_t turn(std::uint32_t h) const { return opposite[following(following(h))]; }

  /// Makes two half-edges one edge; \p beyond may be none.
  void link(std::uint32_t h, std::uint32_t beyond) const {
    opposite[h] = beyond;
    if (beyond != none) opposite[beyond] = h;
  }

  /// The half-edges that leave the vertex; of a closed mesh.
  template <class Visit>
  void visit_leaving(std::uint32_t vertex, Visit visit) const {
    std::uint32_t h = leaving[vertex];
    do {
      visit(h);
      h = turn(h);
    } while (h != leaving[vertex]);
  }

  /// How many leave it.
  std::uint32_t valence(std::uint32_t vertex) const {
    std::uint32_t count = 0;
    visit_leaving(vertex, [&](std::uint32_t) { ++count; });
    return count;
  }

  /// Whether an edge runs between the vertices.
  bool joined(std::uint32_t a, std::uint32_t b) const {
    std::uint32_t h = leaving[a];
    do {
      if (to(h) == b) return true;
      h = turn(h);
    } while (h != leaving[a]);
    return false;
  }

  /// Turns the edge of h, which is not on a border, into the other diagonal:
  ///
  ///           c                         c
  ///         /   \                     / | \       there: the half-edge d -> c of the left triangle,
  ///        /     \                   /  |  \      which takes the place of h's
  ///       a -h--> b                 a   |   b
  ///        \     /                   \  |  /      back: c -> d of the right one, which takes that
  ///         \   /                     \ | /       of the neighbour
  ///           d                         d
  ///
  /// Which of the triangle's three half-edges these become, the caller says.
  void flip(std::uint32_t h, std::uint32_t there, std::uint32_t back) const {
    const std::uint32_t g = opposite[h];
    const std::uint32_t h1 = following(h), h2 = following(h1), g1 = following(g),
                        g2 = following(g1);
    const std::uint32_t a = triangles[h], b = triangles[g], c = triangles[h2], d = triangles[g2];
    const std::uint32_t bc = opposite[h1], ca = opposite[h2], ad = opposite[g1], db = opposite[g2];
    const std::uint32_t there1 = following(there), there2 = following(there1),
                        back1 = following(back), back2 = following(back1);
    triangles[there] = d, triangles[there1] = c, triangles[there2] = a;
    triangles[back] = c, triangles[back1] = d, triangles[back2] = b;
    link(there, back);
    link(there1, ca), link(there2, ad);
    link(back1, db), link(back2, bc);
    if (!leaving.empty())
      leaving[a] = there2, leaving[b] = back2, leaving[c] = there1, leaving[d] = back1;
  }
};

}  // namespace polyhull::hull
