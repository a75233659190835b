// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How deep a point lies inside the visual hull, from the silhouettes alone.
///
/// For camera k let d_k(X) be the signed distance in its picture of the point's image from the
/// silhouette's outline (positive inside), z_k its depth and f_k the focal length. Then
///
///   H(X) = min over k of d_k(X) z_k / f_k,   and the distances from the bounds' planes,
///
/// in cells. Its zero set is the hull; near it, and where one camera decides, it is the distance.
#pragma once

#include <span>
#include <vector>

#include "refine/field/grid.h"
#include "refine/field/silhouette_map.h"
#include "refine/loops/loops.h"

namespace polyhull::refine {

/// One camera in the refiner's frame, with its silhouette.
struct ContactView {
  float pixel[3][4] = {};  ///< homogeneous pixel of a point; the third is its depth
  float focal = 1.0f;      ///< pixels
  float beyond = -40.0f;   ///< pixels: what a point that a map does not reach is said to be inside
  Vec3f centre{0.0f};
  PictureBox within;     ///< what is looked at
  SilhouetteMap coarse;  ///< the whole picture
  SilhouetteMap fine;    ///< a band around the outline

  /// What the inner loops know of \p map.
  MapView look(const SilhouetteMap& map) const;

  /// Where the box from \p low to \p high may be in the picture; everywhere if it reaches behind the
  /// camera.
  PictureBox box_of(const Vec3f& low, const Vec3f& high) const;

  Vec3f project(const Vec3f& p) const {
    const auto dot = [&](const float(&m)[4]) {
      return m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3];
    };
    const float depth = dot(pixel[2]);
    const float inverse = 1.0f / depth;
    return {dot(pixel[0]) * inverse, dot(pixel[1]) * inverse, depth};
  }
};

/// H of all cameras and bounds.
struct HullDistance {
  std::vector<ContactView> views;
  Vec3f low{-1e9f}, high{1e9f};  ///< of the bounds

  /// How far inside the bounds.
  float from_bounds(const Vec3f& point) const;

  /// From the coarse maps; below \p enough only that it is.
  float rough(const Vec3f& point, float enough) const;

  /// From the fine maps, exact within their band; below \p enough only that it is.
  float exact(const Vec3f& point, float enough) const;

  /// rough() on all of \p grid's nodes, at least \p least and at most `deepest`; blocks of nodes far
  /// outside are found by their middle and skipped. Nodes beyond \p rows have \p least.
  void fill(const Grid& grid, float least, std::vector<float>& values, std::vector<Extent>& rows,
            int threads) const;
};

/// HullDistance::rough() or exact() row by row; both say more than there: how far outside.
class HullRows {
 public:
  enum class By { rough, exact };
  /// \p hull outlives it, and keeps its maps.
  HullRows(const HullDistance& hull, By by);

  /// Of the point of node x, which need not be whole, of row (y, z) of \p grid for each of \p x.
  void find(const Grid& grid, float y, float z, std::span<const float> x, float* out) const;

 private:
  const HullDistance& hull_;
  std::vector<MapView> views_;
};

}  // namespace polyhull::refine
