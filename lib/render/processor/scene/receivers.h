// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The places of the scene that light falls on, as pixels see them.
#pragma once

#include <cstdint>

#include "raytrace/traced_scene.h"
#include "render/processor/scene/scene_layer.h"

namespace polyhull::processor {

/// A place of the scene that light falls on.
struct Receiver {
  Vec3f point;   ///< where rays start
  Vec3f normal;  ///< unit length, to the eye's side
};

/// Finds receivers of one view; fast where neighbours are asked for one after the other.
class ReceiverFinder {
 public:
  /// Both must outlive this.
  ReceiverFinder(const TracedScene& scene, const SceneLayer& layer, const Vec3f& eye)
      : scene_(scene), layer_(layer), eye_(eye) {}

  /// At the middle of pixel (x, y), which is drawn and shows something, seen along \p direction.
  Receiver at(int x, int y, const Vec3f& direction);

 private:
  void look_at(std::uint32_t number, const Vec3f& direction);

  const TracedScene& scene_;
  const SceneLayer& layer_;
  Vec3f eye_;
  std::uint32_t number_ = no_triangle;  // of the piece that the rest is of
  bool flat_ = false;                   // its corners' normals are its own
  Vec3f corner_[3] = {}, normal_{0.0f}, above_{0.0f};
};

}  // namespace polyhull::processor
