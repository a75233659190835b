// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the scene's surfaces scatter, pixel by pixel of one view; found where somebody asks, and kept as
/// long as the view stays.
#pragma once

#include <cstdint>
#include <vector>

#include "raytrace/traced_scene.h"
#include "render/processor/scene_layer.h"

namespace polyhull::processor {

class AlbedoLayer {
 public:
  /// Begins anew for \p layer's view.
  void reset(const SceneLayer& layer);

  /// Of the surface at the middle of pixel (x, y), seen from \p eye: its base colour, less what a
  /// mirror reflects instead, 16 bits a channel (0xffff is 1), red lowest; the highest 16 bits mean
  /// nothing. Threads may ask for different pixels at once.
  std::uint64_t at(const TracedScene& scene, const SceneLayer& layer, const Vec3f& eye, int x,
                   int y);

 private:
  std::vector<std::uint64_t> known_;  // 16 bits per colour, and a 1 above them where known
};

}  // namespace polyhull::processor
