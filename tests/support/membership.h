// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Is a point in the hull? Asked of the silhouettes (the definition) and of the mesh (the result).
///
/// Silhouettes: X is inside when, for every camera, it lies in front and its pixel K (R X + t) / z
/// is inside that camera's rings by the even-odd rule, and X is inside the bounds. Decisions are
/// made in double precision with an error bound, then in long double; a point that even that cannot
/// place (nearer than about 1e-15 of the scene's size to a cone) is reported as undecided. Mesh:
/// the winding number, by counting the triangles above the point with their orientation. Ties are
/// broken as if the point were moved by (e, e^2, 0) for an infinitely small e.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "hull/hull.h"

namespace polyhull::test {

/// The silhouettes' own answer, for many points at once.
class SilhouetteMembership {
 public:
  enum Answer : std::int8_t { outside = 0, inside = 1, undecided = 2 };

  SilhouetteMembership(std::span<const Silhouette> silhouettes, const HullOptions& options);

  Answer ask(const Vec3& X) const;
  /// One answer per point; several times as fast as asking one by one.
  std::vector<Answer> ask(std::span<const Vec3> points) const;

 private:
  struct Edge {
    double u0, v0, u1, v1;
  };
  struct Region {  // even-odd polygon, its edges sorted into horizontal bands
    double top = 0, per_band = 0;
    std::uint32_t bands = 0;
    std::vector<std::uint32_t> start;
    std::vector<Edge> edges;
  };
  struct View {
    Mat3 KR;
    Vec3 Kt;
    const Camera* camera;
    Region region;
    bool everything = false;  // no rings and a camera that is not asked
  };
  template <class Real>
  static Answer place(const View& view, const Vec3& X, bool keep_unseen);
  static Region index(const Rings& rings);

  std::vector<View> views_;
  std::optional<Bounds> bounds_;
  bool keep_unseen_;
};

/// The winding number of a closed triangle mesh around points, with a grid over x and y.
class MeshMembership {
 public:
  explicit MeshMembership(const Hull& hull);
  int winding(const Vec3& X) const;

 private:
  const Hull& hull_;
  int columns_ = 0;
  Vec2 corner_{0.0}, per_cell_{0.0};
  std::vector<std::uint32_t> start_, triangles_;
};

struct MembershipReport {
  std::size_t points = 0;
  std::size_t inside = 0;
  std::size_t undecided = 0;
  std::size_t missing = 0;      ///< in the silhouettes, not in the mesh
  std::size_t extra = 0;        ///< in the mesh, not in the silhouettes
  std::size_t bad_winding = 0;  ///< winding numbers other than 0 and 1
  double worst_distance = 0.0;  ///< of a wrong point from the mesh's surface
  Vec3 worst{0.0};
  double volume = 0.0;  ///< of the silhouettes' cones, by counting
  std::size_t wrong() const { return missing + extra + bad_winding; }
};

/// Asks both about \p count random points in \p box (seeded by \p seed).
MembershipReport compare_membership(const Hull& hull, std::span<const Silhouette> silhouettes,
                                    const HullOptions& options, const Bounds& box,
                                    std::size_t count, std::uint64_t seed);

/// The box around the hull's vertices, widened by \p margin of its size on every side.
Bounds box_of(const Hull& hull, double margin);

/// The smallest box that holds both.
Bounds join(const Bounds& a, const Bounds& b);

/// Distance of \p X from the nearest triangle.
double distance_to_surface(const Hull& hull, const Vec3& X);

}  // namespace polyhull::test
