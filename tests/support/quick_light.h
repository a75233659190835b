// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Light of a scene that takes little time and is good enough to be looked at.
#pragma once

#include "raytrace/light_cache.h"

namespace polyhull::synthetic {

/// \p samples: rays to each light, and as many that bounce.
inline LightCacheOptions quick_light(int samples) {
  LightCacheOptions options;
  options.spacing = 0.05f;
  options.bounce_spacing = 0.25f;
  options.light_samples = options.bounce_samples = samples;
  return options;
}

}  // namespace polyhull::synthetic
