// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What each view weighs at each vertex of a mesh for one viewport, before a fragment is asked what
/// the view sees of it.
///
/// Of vertex v with normal n, eye E and view k with centre C, t the weight that hulltexture gave
/// (Texturing::weights), a the angle at v between the ways to C and to E:
///   camera_normal  t^2: the better view prevails, with less of a ghost from the other
///   viewing_angle  t max(((1 + cos a) / 2)^4, .001)
///   lumigraph      t A R, after Buehler et al., Unstructured Lumigraph Rendering, 2001:
///     A = 1 / (1 + (sin(a / 2) / sin 15 degrees)^4): 1 for a view from where the eye is, one half at
///         30 degrees, and never 0
///     R = min(1, s_k / s_E): the view's pixels to a length on the surface over the viewport's,
///         s_k = f_k cos_k / z_k with the obliquity cos_k = max(0, n . (C - v) / |C - v|) and the depth
///         z_k, s_E the same of the viewport, its obliquity at least .1: a view that sees the surface
///         as finely as the viewport shows it loses nothing. Over the largest R of v's views: where
///         none is as fine, the finest loses nothing, and does not fade into the fill
///     The third, the field of view, counts for all metrics, fragment by fragment: the depth maps'
///     fade is 0 beyond the camera's frame (OcclusionMap).
#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh.h"

namespace polyhull {

/// An eye on a mesh.
struct MeshEye {
  Vec3 place{0.0};          ///< mesh world coordinates
  double pixel_size = 0.0;  ///< of its picture at depth 1
};

class ViewWeights {
 public:
  /// None: not to be asked.
  ViewWeights() = default;
  /// \p mesh has a texturing with weights and normals for all its vertices and views. Views without
  /// a picture weigh nothing.
  ViewWeights(const Mesh& mesh, const MeshEye& eye);

  float operator()(std::size_t vertex, std::size_t view) const {
    return weights_[vertex * views_ + view];
  }

 private:
  std::size_t views_ = 0;
  std::vector<float> weights_;
};

}  // namespace polyhull
