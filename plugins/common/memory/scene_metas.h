// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is beside a frame that shows a scene, for composite, which draws into it in the same process.
#pragma once

#include "plugins/common/memory/shared_meta.h"
#include "render/depth_picture.h"
#include "view/scene_planes.h"

namespace polyhull::element {

struct DepthTraits {
  using Value = DepthPicture;
  static constexpr char api_name[] = "PolyhullDepthMetaAPI";
  static constexpr char meta_name[] = "PolyhullDepthMeta";
};
/// The depth of what the frame shows, by trackstamp.
using DepthMeta = SharedMeta<DepthTraits>;

struct PlanesTraits {
  using Value = ScenePlanes;
  static constexpr char api_name[] = "PolyhullPlanesMetaAPI";
  static constexpr char meta_name[] = "PolyhullPlanesMeta";
};
/// The planes of the scene's triangles that scenesrc drew the frame with. They say of what view they
/// are, and who takes them compares that with the view it needs, so they may stay with a frame through
/// any element that copies metas, also one that changes the picture.
using PlanesMeta = SharedMeta<PlanesTraits>;

}  // namespace polyhull::element
