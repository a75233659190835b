// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which cameras colour which part of a hull, and how much: what hulltexture adds to a mesh and
/// composite draws with.
#pragma once

#include <cstdint>
#include <vector>

#include "base/vector.h"

namespace polyhull {

enum class TextureMethod {
  direct,  ///< the one best camera of each triangle
  blend,   ///< the best cameras, weighted per fragment
};

enum class TextureMetric {
  camera_normal,  ///< by the angle between the surface normal and the direction to the camera
  viewing_angle,  ///< by the angle between the directions to the camera and to the viewport
};

/// View k of a mesh is bit k of the masks and column k of the weights; at most 64 views.
struct Texturing {
  TextureMethod method = TextureMethod::blend;
  TextureMetric metric = TextureMetric::camera_normal;
  std::uint32_t cameras = 2;        ///< blend of the best this many
  Vec3f untextured{0.5f};           ///< colour (sRGB, 0..1) of what no camera sees
  std::vector<std::uint64_t> visible;  ///< per triangle: the views that see it unoccluded
  std::vector<std::int8_t> best;       ///< per triangle: the view of method direct, -1: none
  std::vector<float> weights;          ///< per vertex, per view: camera-normal weight faded towards
                                       ///< occlusion, 0..1, not normalised; vertex-major
  std::vector<Vec3f> normals;          ///< per vertex, unit length
};

}  // namespace polyhull
