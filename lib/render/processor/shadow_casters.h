// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The subjects as they stand in the main light's way, for all views of the scene.
#pragma once

#include <cstdint>
#include <optional>

#include "raytrace/ray_caster.h"
#include "render/frame.h"
#include "render/light_reach.h"

namespace polyhull::processor {

class ShadowCasters {
 public:
  /// The subjects that block \p light now, in scene coordinates. \p same: they, and the light, are
  /// those of the last call.
  void set(const RenderPlan& plan, const Light& light, bool same);

  /// For rays to points of the light.
  const RayCaster& caster() const { return caster_; }
  /// Where none of them can be blocked.
  const LightReach& reach() const { return reach_; }
  /// Another number than before where places found by reach() are others now.
  std::uint64_t map() const { return map_; }

 private:
  RayCaster caster_{RayCaster::For::one_frame};
  std::optional<std::uint32_t> mesh_;
  LightReach reach_;
  std::uint64_t map_ = 1;
};

}  // namespace polyhull::processor
