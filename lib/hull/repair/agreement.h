// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How much of one camera's line of sight the other cameras see inside their silhouettes.
///
/// The ray of pixel u of camera k is X(s) = C_k + s d, s > 0 its depth. In camera j it is the line
/// of homogeneous pixels a + s b with a = M_j C_k + m_j, b = M_j d (M = K R, m = K t): the epipolar
/// line L = a x b. With the unit vector e = (L_y, -L_x)/|L_xy| along it, a point of the line has the
/// coordinate w = e·p, and
///
///     w(s) = (e·a + s e·b)/(a_z + s b_z),   w'(s) = |L_xy|/(a_z + s b_z)^2 > 0,
///
/// so w rises with s as long as the point is before camera j, and the crossings of the line with
/// the silhouette's edges, sorted by w, are the ends of the stretches of the ray that camera j sees
/// inside (image-based visual hulls: Matusik et al. 2000). No raster, so nothing is lost between
/// its samples.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/rings.h"
#include "hull/hull.h"

namespace polyhull::hull {

/// The silhouettes of one set, ready to be asked. May be asked by several threads at once, each with
/// a Scratch of its own.
class Agreement {
 public:
  /// Under Unseen::keep a camera rejects nothing outside its frame.
  Agreement(std::span<const Silhouette> views, Unseen unseen);

  /// \p view's silhouette from now on, in pinhole pixels.
  void replace(std::size_t view, const Rings& rings);

  /// Memory of one thread.
  struct Scratch {
    struct End {
      double s;
      int step;  ///< by which the sum of votes changes here
    };
    std::vector<double> crossings;
    std::vector<End> ends;
  };

  /// A stretch of a ray.
  struct Stretch {
    double across = 0.0;  ///< length over depth of its far end, in pixels of the ray's camera
    double depth = 0.0;   ///< of its middle; infinite where it never ends
  };

  /// The longest stretch of the ray through the pinhole pixel \p pixel of view \p view that none of
  /// the other views rejects and at least \p fewest see inside their silhouettes.
  Stretch longest(std::size_t view, const Vec2& pixel, std::size_t fewest, Scratch& scratch) const;

  static constexpr int nobody = -1, several = -2;
  /// Which view alone keeps the others from having a stretch of the ray in common: `nobody` where
  /// they have one, `several` where leaving out one view does not help; of several views the one
  /// without which the stretch is the longest.
  int objector(std::size_t view, const Vec2& pixel, Scratch& scratch) const;

  /// Whether the others have no stretch of the ray in common, but would have one without \p objector,
  /// and without no other view.
  bool is_only_objector(std::size_t view, const Vec2& pixel, std::size_t objector,
                        Scratch& scratch) const;

  /// Whether an outline of \p view runs within \p distance pixels of \p pixel.
  bool near_outline(std::size_t view, const Vec2& pixel, double distance) const;

  std::size_t size() const { return views_.size(); }
  const Camera& camera(std::size_t view) const { return *views_[view].camera; }

  /// A few edges of a ring, one after the other, in their box: most lines miss most boxes.
  struct Edges {
    static constexpr std::size_t most = 8;
    Vec2 middle{0.0}, half{0.0};
    std::array<Vec2, most + 1> points;
    std::size_t count = 0;  ///< of points
  };

 private:
  struct View {
    const Camera* camera;
    Mat3 M{1.0};
    Vec3 m{0.0}, centre{0.0};
    std::vector<Edges> edges;
    std::size_t silhouette_edges = 0;  ///< of `edges`; those of the frame's border follow
  };
  bool add_stretches(const View& from, const Vec3& direction, const View& seen,
                     std::span<const Edges> edges, int step, Scratch& scratch) const;
  static void add_ring(View& view, std::span<const Vec2f> ring);
  template <class Visit>
  void visit_parts(std::size_t view, const Vec2& pixel, Scratch& scratch, Visit visit) const;

  std::vector<View> views_;
  Unseen unseen_;
};

}  // namespace polyhull::hull
