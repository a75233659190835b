// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Silhouettes, the visual hull that they make, and how (build/hull_builder.h).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/rings.h"
#include "rig/camera.h"

namespace polyhull {

/// One camera's silhouette, in pinhole (undistorted) pixels of that camera.
struct Silhouette {
  const Camera* camera = nullptr;
  const Rings* rings = nullptr;
};

/// What to do with space that a camera does not see (outside its frame, behind it).
enum class Unseen {
  carve,  ///< it is outside the hull, as in the prototype
  keep,   ///< that camera says nothing about it; needs bounds
};

/// How silhouettes become a hull.
struct HullOptions {
  std::optional<Bounds> bounds;  ///< the hull is limited to this box
  Unseen unseen = Unseen::carve;
  /// World units; how far simplification may move the surface, 0 = none.
  double max_deviation = 0.0;
  int threads = 1;  ///< of the pool; below 1 counts as 1
  /// False: works as if nothing were known from earlier calls; the result is the same bytes, and
  /// the time that of new silhouettes.
  bool reuse = true;
  bool operator==(const HullOptions&) const = default;
};

/// A face of the hull: one planar polygon with holes lies on the plane of one contour edge of one
/// camera (or of the bounds). A surface inside the hull (refine/refine.h) has faces of no plane.
struct HullFace {
  static constexpr std::uint32_t no_edge = 0xffffffffu;

  std::int32_t view = -1;  ///< index into the silhouettes; -1: a face of the bounds, or of no plane
  std::uint32_t edge = 0;  ///< index of the contour edge's first vertex in that Rings::points;
                           ///< for bounds 0..5: -x +x -y +y -z +z; no_edge: of no plane
  std::uint32_t first_triangle = 0;
  std::uint32_t triangle_count = 0;
};

/// A closed, oriented, 2-manifold triangle mesh (outside seen counter-clockwise) with its origin
/// kept in double precision, so that float coordinates lose nothing far from the world's origin.
struct Hull {
  Vec3 origin{0.0};                      ///< world position of (0, 0, 0) of the vertices
  std::vector<Vec3f> vertices;           ///< relative to origin, world units
  std::vector<std::uint32_t> triangles;  ///< three vertex indices each, grouped by face
  /// Per vertex, unit length, out of the solid: of a smooth surface; none: a polyhedron.
  std::vector<Vec3f> normals;
  std::vector<HullFace> faces;
  // Loops of the polygons, for wire frames and exact use: face i has loops
  // face_loop_ends[i-1] .. face_loop_ends[i], loop k has the vertex indices
  // loop_vertices[loop_ends[k-1] .. loop_ends[k]].
  std::vector<std::uint32_t> loop_vertices;
  std::vector<std::uint32_t> loop_ends;
  std::vector<std::uint32_t> face_loop_ends;
  bool empty() const { return triangles.empty(); }
};

}  // namespace polyhull
