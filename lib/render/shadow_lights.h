// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which of a scene's lights throw a shadow of the subjects that can be seen.
///
/// What stands at least r away from all of a light blocks, of what the light gives any place behind it, at
/// most power * exit / r^2: nothing behind is nearer. With the exposure, over pi, on a white surface, that
/// bounds what any pixel can lose.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/vector.h"
#include "scene/scene.h"

namespace polyhull {

/// A light whose shadow is drawn.
struct ShadowLight {
  std::size_t light = 0;  ///< which of RenderFrame::lights
  /// The most that it gives the middle of the subjects' box or of one of its faces, of what all of
  /// these lights do: how much care its shadow is worth (shadow_recipe.h).
  float share = 1.0f;
  bool idle = false;   ///< of no effect at all
  bool sharp = false;  ///< beside it soft lights are drawn in one, which have no edges
  Rectangle seen;      ///< the pixels that it may change
  /// Those in which each of RenderPlan::mirrors may show it.
  std::vector<Rectangle> in_mirrors;
};

/// The lights that can throw a visible shadow of what stands in \p box, those that give it most first,
/// without rectangles. Left out are idle ones, unless \p all are wanted, and, in any case, the weakest
/// ones that together change no picture value (at \p exposure) by more than a 24th of the smallest
/// step.
std::vector<ShadowLight> find_shadow_lights(std::span<const Light> lights, float exposure,
                                            const Bounds& box, bool all);

}  // namespace polyhull
