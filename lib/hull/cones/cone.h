// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One camera's silhouette made ready: clean rings, exact rays and planes, and the grid over them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/vector.h"
#include "hull/cones/contour_grid.h"
#include "hull/exact/planes.h"
#include "hull/hull.h"

namespace polyhull::hull {

/// Where the integers of exact geometry lie in the world: integer = (world - origin) * scale.
/// It follows from the cameras and the bounds alone, so that it holds from one set of pictures to
/// the next.
struct Lattice {
  Vec3 origin{0.0};
  double scale = 1.0;  ///< a power of two
  bool operator==(const Lattice&) const = default;
};

using IntVec = std::array<std::int64_t, 3>;
inline Vec3 real(const IntVec& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// What of a camera the hull uses.
struct ConeCamera {
  Mat3 to_pixel{1.0};  ///< K R: direction in the world to homogeneous pixel
  Mat3 to_ray{1.0};    ///< its inverse
  Vec3 forward{0.0};   ///< unit, out of the camera
  Vec3 centre{0.0};    ///< world
  int width = 0, height = 0;
};

/// A silhouette seen from its camera. Vertex i of the rings is the ray i and begins the edge i; the
/// edge's plane is the cone's face i.
struct Cone {
  ConeCamera camera;
  IntVec centre{};        ///< on the lattice, below 2^44
  Vec3 centre_real{0.0};  ///< the same in doubles (exact)
  std::vector<Vec2> pixels;
  std::vector<IntVec> rays;  ///< components below 2^39
  std::vector<std::uint32_t> next, previous, ring;
  /// At vertex i: 1 where the solid's angle is below 180 degrees, else -1.
  std::vector<std::int8_t> turn;
  std::vector<std::uint32_t> source;  ///< the edge's number in the input (index of its first point)
  std::vector<std::int32_t> source_view;
  std::vector<Plane> planes;
  std::vector<Vec3> normals;  ///< unit, into the solid
  IntVec axis{};              ///< positive on every ray; about 2^20 long
  std::uint32_t rings = 0;
  bool complement = false;  ///< the solid is what the rings do not hold (Unseen::keep)
  ContourGrid grid;
  std::uint32_t input_vertices = 0;
  std::uint64_t compared_pairs = 0;  ///< of edges, to see that the rings are simple
  /// Lengths of the rows of camera.to_pixel: the longer of the first two, and the third.
  double pixel_scale = 0, depth_scale = 0;
  double pixel_error = 0;   ///< px by which a ray may be off its pixel
  bool own_pixels = false;  ///< pixels are those of the rounded rays, not of the contours

  std::size_t size() const { return rays.size(); }
};

/// A camera's part of a cone; \p index is its number, for errors. \throw Error naming the camera if
/// it is not finite or degenerate.
ConeCamera read_camera(const Camera& camera, std::size_t index);

/// The centre of \p camera on the lattice.
IntVec lattice_centre(const ConeCamera& camera, const Lattice& lattice);

/// One view of a cone.
struct ConeInput {
  const Silhouette* silhouette = nullptr;
  const ConeCamera* camera = nullptr;
  std::int32_t view = 0;  ///< its index, for Cone::source_view
};

/// Fills \p cone from the rings of one or several views of the same centre (they are intersected).
/// \throw Error naming the camera for points that are not finite or too far to the side, and for
/// rings that cannot be made simple.
void build_cone(Cone& cone, std::span<const ConeInput> inputs, const Lattice& lattice,
                Unseen unseen);

}  // namespace polyhull::hull
