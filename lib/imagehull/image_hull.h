// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The visual hull as a viewport sees it, without a mesh: for each ray, where it first enters the
/// intersection of all silhouettes' cones (W. Matusik et al., "Image-based visual hulls", SIGGRAPH
/// 2000).
///
/// A ray's image in a view is a straight line, which the silhouette cuts into intervals; the hull on the
/// ray is where the intervals of all views overlap:
///
///     view A   ....======.....=====....      near ---> far
///     view B   ..=====.......=======...
///     hull     ....===........=====....      the ray enters at the first "="
///
/// Matusik sorts a silhouette's edges into bins by their angle around the epipole, so that a line finds
/// those that it crosses. Here a part of the screen has its own list (bundle()): the edges, in short
/// chains, that lines of its rays can cross at all. It needs no order, and no care where the epipole
/// lies in the silhouette or at infinity. What each ray costs is in loops/loops.h.
///
/// The surface is that of hull/hull.h under Unseen::carve without bounds, to what single precision
/// leaves: about 1e-6 of the distance where rays meet it at large angles.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "imagehull/loops/loops.h"

namespace polyhull {

class ImageHull {
 public:
  /// Rays that are asked at once, and what their hits are.
  static constexpr int lanes = imagehull::lanes;
  /// Of a silhouette. A ray that crosses c of them may cost c^2 steps.
  static constexpr std::size_t most_edges = 16384;
  using Directions = imagehull::Directions;
  struct Hits {
    float inverse[lanes];       ///< 1/s of o + s d, s in lengths of d; 0: no hit
    std::uint32_t face[lanes];  ///< for view_of(), across(); 0 where there is no hit
  };

  /// A place that rays start from.
  struct Origin {
    std::vector<std::array<float, 3>> start;  ///< by view: loops.h's o'
    std::vector<std::uint8_t> inside;         ///< by view: whether it lies in the cone
  };

  /// The chains of edges that some rays from an origin can cross, view by view.
  struct Bundle {
    std::vector<std::uint32_t> chains;
    std::vector<std::uint32_t> ends;  ///< by view, into chains
    bool empty = true;                ///< no ray of them can hit
  };

  /// A thread's working memory.
  struct Scratch {
    std::vector<float> inverse;
    std::vector<std::uint32_t> edges;
    std::vector<imagehull::ViewCrossings> views;
  };

  /// The hull of \p views, whose rings may go afterwards. Throws Error (bad_input) for cameras and
  /// contours that are not finite, or cameras without a focal length.
  explicit ImageHull(std::span<const Silhouette> views);

  /// Whether there is nothing to see: a view without a silhouette, fewer than two views, or cones that
  /// do not meet.
  bool empty() const { return corners_.empty(); }

  /// The corners of a convex shape around the hull, world: enclosing.h.
  const std::vector<Vec3>& corners() const { return corners_; }

  /// The faces are numbered from 0 to this, one per edge of a silhouette.
  std::uint32_t faces() const { return static_cast<std::uint32_t>(across_.size()); }
  std::size_t view_of(std::uint32_t face) const;

  /// The unit vector across the face's plane, world; to either side.
  const Vec3f& across(std::uint32_t face) const { return across_[face]; }

  /// Rays from \p place (world), which is taken to lie a little behind a camera whose centre it is.
  Origin from(const Vec3& place) const;

  /// The chains for rays from \p origin between the four directions \p corners (in any order).
  void gather(const Origin& origin, const std::array<Vec3f, 4>& corners, Bundle& bundle) const;

  /// The chains for all rays.
  const Bundle& all() const { return all_; }

  /// Where the rays in \p directions from \p origin first enter the hull beyond \p near (1/s; infinity:
  /// the origin), of which \p bundle has the chains. Who starts inside leaves first. Several threads
  /// may ask at once, each with its own scratch.
  void enter(const Origin& origin, const Bundle& bundle, const Directions& directions,
             const float (&near)[lanes], Scratch& scratch, Hits& hits) const;

 private:
  struct View {
    Vec3 centre{0.0};
    Mat3 turn{1.0};    // from the world's directions to homogeneous pixels around the middle
    Vec3 ahead{0.0};   // a way out of the centre into its picture
    float rows[9];     // of turn
    Vec2 middle{0.0};  // pinhole pixels
    std::uint32_t first_face = 0;
    std::vector<Vec2f> points;               // of all rings, around the middle; face - first_face
    std::vector<std::uint32_t> next;         // by point: the ring's next
    std::vector<float> boxes[4];             // loops.h's
    std::vector<float> chain_points;         // loops.h's
    std::vector<std::uint32_t> first_edges;  // loops.h's
    imagehull::Chains chains() const;
    bool holds(const Vec2& pixel) const;
  };
  static View prepared(const Silhouette& silhouette);
  static void add_chains(View& view, std::uint32_t begin, std::uint32_t end);

  std::vector<View> views_;
  std::vector<Vec3> corners_;
  Bundle all_;
  std::vector<Vec3f> across_;  // by face
  double nearest_ = 0.0;       // origins nearer to a centre than this are moved off it
};

}  // namespace polyhull
