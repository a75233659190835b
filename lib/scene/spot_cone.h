// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The cone of a spot, as glTF's KHR_lights_punctual has it.
///
/// At the angle a from its axis a spot has the intensity that it has along the axis, times
///   clamp(scale cos a + offset, 0, 1)^2,
///   scale = 1 / max(0.001, cos inner - cos outer), offset = -cos outer * scale.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/scene.h"

namespace polyhull {

struct SpotCone {
  float scale = 0.0f, offset = 1.0f;
  /// The share of the axis's intensity at an angle of cosine \p cosine; 1 for what is no spot.
  float at(float cosine) const {
    const float share = std::clamp(scale * cosine + offset, 0.0f, 1.0f);
    return share * share;
  }
};

inline SpotCone cone_of(const Light& light) {
  if (!light.is_spot()) return {};
  const float outer = std::cos(light.outer_cone);
  const float scale = 1.0f / std::max(0.001f, std::cos(light.inner_cone) - outer);
  return {scale, -outer * scale};
}

}  // namespace polyhull
