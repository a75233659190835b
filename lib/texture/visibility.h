// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How much of each triangle of a mesh each view sees: see texture_hull.h.
///
/// A view draws the mesh's depths once, on a grid. What hides a part of a triangle ends at a rim
/// before it: an edge between a triangle that faces the view and one that does not. Triangles far
/// from rims before them are seen or hidden as a whole, as the grid tells. Where a rim may run
/// across, 64 points spread over the triangle are held against the triangles that cover that part
/// of the picture, so shares are finer than the grid. Triangles larger than some texels are judged
/// piece by piece.
///
/// Where a mesh crosses itself, against the promise of Hull, no rim need end what hides: a triangle
/// is seen whole there if a part of it is.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/mesh_faces.h"
#include "texture/texture_loops.h"
#include "texture/texturing.h"

namespace polyhull {

/// Below this cosine of the angle between its normal and the way to a view a triangle counts as
/// edge-on and is not seen: its picture has no width.
inline constexpr float edge_on = 1e-3f;

/// What one view sees.
struct Sight {
  std::vector<float> share;   ///< per triangle, of its area: seen_fk of texture_hull.h
  std::vector<float> cosine;  ///< per triangle: cos_fk at the centroid; 0 for the view's own cone
  std::vector<float> sums;    ///< per vertex, of the triangles around it: the area that faces the
                              ///< view, and of this what is seen
  OcclusionMap map;
  std::uint64_t pieces = 0;   ///< of triangles that face the view
  std::uint64_t sampled = 0;  ///< of these: those that points had to decide
};

struct SightSettings {
  bool occlusion = true;  ///< off: what faces the view and has its centroid in the frame is seen
  bool map = true;        ///< whether the map is wanted
  int map_size = 320;
  double fade_width = 12.0;
};

/// Finds what views see, one after the other, and keeps the memory. One object per thread.
class Seer {
 public:
  explicit Seer(const TextureLoops& loops = TextureLoops::best());
  ~Seer();

  /// View number \p number of \p hull. The hull's indices must be in order and its vertices finite.
  /// What lies outside the camera's frame, real pixels, is not seen.
  void look(const Hull& hull, const MeshFaces& faces, const Camera& camera, int number,
            const SightSettings& settings, Sight& out);

 private:
  struct Scratch;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace polyhull
