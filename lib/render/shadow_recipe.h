// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How much work a shadow is, by its quality and by what share of the light it is of: both renderers do
/// what this says. A light that gives a share of the light has about that share of the rays, or cells: its
/// shadow's error counts that much less.
#pragma once

#include <algorithm>
#include <cmath>

#include "render/frame.h"
#include "render/light_samples.h"

namespace polyhull {

/// How a light's shadow is made for a ShadowQuality.
struct ShadowRecipe {
  bool hard = false;    ///< of the light's middle alone
  bool single = false;  ///< one way to the light tells all: a hard shadow, or a point light's

  // The processor's: rays to points of the light.
  int rays = 12;       ///< of a pixel
  int first_rays = 4;  ///< of these; the others only where the first do not agree, there and around
  bool masked = true;  ///< looked up in images of what meshes hide (light_masks.h), not traced
  int mask_texels = 256;  ///< at most, of these images on a side of the subject
  int ray_step = 2;       ///< only every so many pixels of every so many rows have rays

  // OpenGL's: look-ups in depth maps.
  int cells = max_light_samples;  ///< of an area light, each with maps of its own: n * n
  int taps = 4;               ///< looks in each cell, for blockers and then for light; 0: one alone
  int map_size = 256;         ///< texels a side of the subjects' maps
  int scene_map_size = 1024;  ///< and of the scene's
  int map_step = 2;           ///< as ray_step

  bool operator==(const ShadowRecipe&) const = default;
};

/// How \p settings make the shadow, which is not off, of \p light, which gives \p share of the light. \p sharp:
/// ShadowLight's.
inline ShadowRecipe shadow_recipe(const RenderSettings& settings, const Light& light, float share,
                                  bool sharp = false) {
  ShadowRecipe recipe;
  recipe.cells = std::clamp(settings.light_samples, 1, max_light_samples);
  recipe.map_size = std::clamp(settings.shadow_map_size, 16, 4096);
  if (settings.shadow == ShadowQuality::fast) {
    recipe.rays = 4;
    recipe.taps = 0;
  } else if (settings.shadow == ShadowQuality::best) {
    recipe.rays = 64;  // traced: masks are as exact as fewer ask for
    recipe.first_rays = 16;
    recipe.masked = false;
    recipe.cells = max_light_samples;
    recipe.taps = 16;
    if (sharp) {  // a sun's edges are finer than a grid of every second pixel
      recipe.ray_step = 1;
      recipe.rays = 16;  // as many for each part of the picture
      recipe.first_rays = 4;
    }
  } else if (settings.shadow == ShadowQuality::hard) {
    recipe.hard = true;
    recipe.masked = false;
    recipe.cells = 1;
    recipe.taps = 0;
    // Finer than the picture, and the scene's as fine as the subjects'.
    recipe.map_size = recipe.scene_map_size = std::clamp(8 * settings.shadow_map_size, 16, 4096);
    recipe.map_step = 1;
  }
  // By halves, so that the rays seldom become others while subjects walk from light to light.
  const auto halved = static_cast<int>(std::lround(std::clamp(-std::log2(share), 0.0f, 6.0f)));
  recipe.rays = (recipe.rays + (1 << halved) - 1) >> halved;
  recipe.first_rays = std::max(recipe.first_rays >> halved, 1);
  recipe.mask_texels = halved >= 2 ? 128 : halved == 1 ? 192 : recipe.mask_texels;
  if (halved >= 2) recipe.cells = std::min(recipe.cells, halved < 5 ? 4 : 1);
  recipe.single = recipe.hard || !light.is_area();
  if (recipe.single) {
    recipe.rays = recipe.first_rays = 1;
    recipe.ray_step = 1;  // one ray a pixel tells nothing of those beside it
  }
  return recipe;
}

}  // namespace polyhull
