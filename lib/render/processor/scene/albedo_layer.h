// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the scene's surfaces scatter, pixel by pixel of one view; found where somebody asks, and kept as
/// long as the view stays.
#pragma once

#include <cstdint>
#include <vector>

#include "base/memory/sparse_array.h"
#include "raytrace/loops/view_loops.h"
#include "raytrace/traced_scene.h"
#include "render/processor/scene/scene_layer.h"
#include "render/projection.h"

namespace polyhull::processor {

class AlbedoLayer {
 public:
  static constexpr int piece = 16;  ///< pixels of a row that are found together

  /// Begins anew for \p part of \p layer's view, from \p eye along \p rays.
  void reset(const Rectangle& part, const Vec3f& eye, const PixelRays& rays);

  /// Of the surfaces at the middles of the 16 pixels from (x, y) on, as far as the picture goes; x is a multiple of 16, any of them is in the part, and \p layer's middles are drawn there: their base colour,
  /// less what a mirror reflects instead, 16 bits a channel (0xffff is 1), red lowest, 0 above. One
  /// look at a texture for each, as coarse as the pixel's area there. Threads may ask for different
  /// pieces at once.
  const std::uint64_t* at(const TracedScene& scene, const SceneLayer& layer, int x, int y);

 private:
  void find(const TracedScene& scene, const SceneLayer& layer, int x, int y, int count,
            std::uint64_t* out) const;
  void scatter(const TracedScene& scene, const SceneLayer& layer, int x, int y, int count,
               Float4* values) const;

  Vec3f eye_{0.0f};
  PixelRays rays_;
  int left_ = 0, top_ = 0;           // a multiple of a piece's pixels; the first row
  std::size_t columns_ = 0;          // pieces
  std::vector<std::uint8_t> known_;  // by piece
  SparseArray<std::uint64_t> values_;
};

}  // namespace polyhull::processor
