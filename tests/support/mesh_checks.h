// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What must hold for every hull, whatever made it: a closed, consistently oriented 2-manifold
/// whose triangles, faces and loops tell the same story.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "hull/hull.h"

namespace polyhull::test {

struct MeshReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t faces = 0;
  /// Directed edges without exactly one partner in the other direction.
  std::size_t unpaired_edges = 0;
  /// Vertices whose triangles are not one closed fan (two parts that touch share a vertex).
  std::size_t split_vertices = 0;
  std::size_t unused_vertices = 0;
  std::size_t bad_indices = 0;
  std::size_t not_finite = 0;
  std::size_t repeated_corners = 0;  ///< triangles that name a vertex twice
  std::size_t flat_triangles =
      0;                      ///< three different vertices, area exactly 0 in float coordinates
  std::size_t slivers = 0;    ///< height below 0.2 % of the longest edge
  double volume = 0.0;        ///< world units cubed; positive when the outside is counter-clockwise
  std::string inconsistency;  ///< first disagreement of faces, loops and triangles; empty: none

  bool closed() const { return bad_indices == 0 && unpaired_edges == 0; }
  bool manifold() const { return closed() && split_vertices == 0 && repeated_corners == 0; }
  /// Everything that must hold without exception.
  bool sound() const {
    return manifold() && not_finite == 0 && unused_vertices == 0 && inconsistency.empty();
  }
  double sliver_share() const { return triangles == 0 ? 0.0 : double(slivers) / double(triangles); }
  std::string describe() const;
};

/// Checks \p hull on its own. An empty hull is sound.
MeshReport check_mesh(const Hull& hull);

struct PlaneReport {
  std::size_t checked = 0;
  std::size_t flipped = 0;  ///< triangles that look the other way than most of their face
  std::size_t wrong_side =
      0;  ///< faces whose winding contradicts the silhouette's (even-odd) inside
  std::size_t bad_source = 0;   ///< faces whose view or edge does not exist
  double worst_distance = 0.0;  ///< of a vertex from its face's plane, world units
};

/// Holds every face against the plane of the contour edge (or side of the bounds) that it names.
PlaneReport check_planes(const Hull& hull, std::span<const Silhouette> silhouettes,
                         const HullOptions& options);

/// The same bytes: every array of \p a equals that of \p b bit for bit.
bool same_bytes(const Hull& a, const Hull& b);

/// Whether the edge from \p p to \p q goes through the triangle \p a, \p b, \p c; not where it only
/// touches it.
bool pierces(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c);

/// A 64-bit fingerprint of all arrays, to compare many hulls without keeping them.
std::uint64_t fingerprint(const Hull& hull);

}  // namespace polyhull::test
