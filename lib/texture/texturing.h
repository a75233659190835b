// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which cameras colour which part of a hull, and how much: what hulltexture adds to a mesh and
/// composite draws with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/vector.h"
#include "rig/camera.h"

namespace polyhull {

enum class TextureMethod {
  direct,  ///< the one best camera of each triangle
  blend,   ///< the best cameras, weighted per fragment
};

enum class TextureMetric {
  camera_normal,  ///< by the angle between the surface normal and the direction to the camera
  viewing_angle,  ///< by the angle between the directions to the camera and to the viewport
  lumigraph,      ///< by that angle, steeper, and by resolution (render/subject/view_weights.h)
};

/// What colours the surface where no camera sees it.
enum class TextureFill {
  grey,     ///< Texturing::untextured
  nearest,  ///< the nearest colour that is seen, over the surface
  inpaint,  ///< what is seen around, continued smoothly over the surface
};

/// Whether pictures that disagree are warped onto each other.
enum class TextureAlign {
  off,
  flow,  ///< by what each view shows of its neighbours' pictures
};

/// What one view sees of the hull, as a small picture in that view's pinhole (undistorted) pixels:
/// texel (i, j) stands for the pixel (x + i * step, y + j * step). A point of the surface at camera
/// depth z is seen by the view if z is not behind the map's depth there; how much it may contribute
/// is the map's fade, which falls to 0 at silhouette edges and occlusion boundaries, so that
/// weights stay continuous over the surface however large the hull's triangles are.
struct OcclusionMap {
  float x = 0.0f;  ///< pinhole pixel of texel (0, 0)
  float y = 0.0f;
  float step = 1.0f;  ///< pinhole pixels from one texel to the next
  int width = 0;      ///< texels; 0: the view sees nothing of the hull
  int height = 0;
  float near = 0.0f;                 ///< camera depth (z) of value 0, world units
  float far = 1.0f;                  ///< camera depth (z) of value 65534
  std::vector<std::uint16_t> depth;  ///< row-major; 65535: nothing there
  std::vector<std::uint8_t> fade;    ///< row-major; 0..255 for 0..1
  bool operator==(const OcclusionMap&) const = default;
};

/// Where a view shows what another one shows, seen through the surface: by how much of this the place
/// in `view` is moved from which a point of the surface takes its colour, the eye decides
/// (render/subject/picture_flows.h). Texel (i, j) stands for texel (2 i, 2 j) of the view's OcclusionMap.
struct PictureFlow {
  static constexpr int coarser = 2;            ///< than the map
  static constexpr float unit = 1.0f / 16.0f;  ///< of an offset: texels of the map
  static constexpr int most_of_view = 2;       ///< flows that a view may have
  int view = 0;
  int other = 0;
  int width = 0;  ///< texels: half the map's, rounded up
  int height = 0;
  std::vector<std::int8_t> offsets;  ///< x, y of each texel, row-major
  bool operator==(const PictureFlow&) const = default;
};

/// View k of a mesh is bit k of the masks and column k of the weights; at most 64 views.
struct Texturing {
  TextureMethod method = TextureMethod::blend;
  TextureMetric metric = TextureMetric::camera_normal;
  std::uint32_t cameras = 2;           ///< blend of the best this many, at least 1
  Vec3f untextured{0.5f};              ///< colour (sRGB, 0..1) of what no camera sees
  std::vector<std::uint64_t> visible;  ///< per triangle: the views that see it unoccluded
  std::vector<std::int8_t> best;       ///< per triangle: the view of method direct, -1: none
  std::vector<float> weights;  ///< per vertex, per view, 0..1, not normalised; vertex-major:
                               ///< camera_normal: the camera-normal weight, else 1;
                               ///< both reduced by the occluded share of the triangles around
  std::vector<Vec3f> normals;  ///< per vertex, unit length
  /// Per vertex: the colour of what no camera sees there (RGBA bytes, sRGB), instead of `untextured`;
  /// or none.
  std::vector<std::uint32_t> fill;
  /// Per view: what its linear red, green and blue are multiplied by, after its camera's own matrix, so
  /// that the cameras agree; or none.
  std::vector<Vec3f> gains;
  std::vector<OcclusionMap> maps;  ///< per view; none for method direct and where occlusion is off
  /// Of pairs of views that disagree, each way, by view and other; none without maps.
  std::vector<PictureFlow> flows;
};

/// What the linear colours of view \p view, seen by \p camera, are multiplied by: the camera's own
/// matrix, then the view's gains.
inline Mat3f colour_of(const Texturing& texturing, const Camera& camera, std::size_t view) {
  Mat3f colour(camera.colour);
  if (view < texturing.gains.size())
    for (int column = 0; column < 3; ++column) colour[column] *= texturing.gains[view];
  return colour;
}

}  // namespace polyhull
