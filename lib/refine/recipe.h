// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How often what is done, by the quality: refine.h says what.
#pragma once

#include <span>

#include "refine/field/fine_field.h"
#include "refine/field/plate.h"
#include "refine/merge/moments.h"
#include "refine/refine.h"

namespace polyhull::refine {

/// First widely, to where outlines of half a pixel's tolerance say, then near the rims alone, a hair
/// further out, so that silhouettes are covered.
inline constexpr RimFit all_fits[] = {
    {.radius = 1.4f, .target = -0.02f, .stride = 3}, {0.75f, 0.0f}, {0.5f, 0.015f}, {0.5f, 0.015f}};
/// Every other ray misses what is between: nearer to what is wanted in the end.
inline constexpr RimFit fewer_fits[] = {{.radius = 1.4f, .target = -0.02f, .stride = 3},
                                        {.radius = 0.75f, .target = 0.012f, .stride = 2},
                                        {0.5f, 0.015f},
                                        {0.5f, 0.015f}};

/// Rims are held softly and their normals firmly: a rim that few other rays support moves with every
/// half pixel of an outline, the normal hardly. The flow has thinned what is not held; the ties keep
/// it so where nothing else decides.
inline constexpr PlateSettings coarse_plate{
    .steps = 20, .value = 4.0f, .normal = 0.5f, .tie = 0.1f, .band = 5.0f, .stride = 4},
    middle_plate{
        .steps = 24, .value = 4.0f, .normal = 0.5f, .tie = 0.08f, .band = 2.0f, .stride = 2};

/// What a quality does.
struct Recipe {
  double cell = 0.024;     ///< metres
  int flows = 6;           ///< on the coarse grid
  float flow_step = 0.5f;  ///< along rays, for its rims
  int coarse_plates = 4;   ///< with rims found anew
  int plates = 2;
  PlateSettings coarse = coarse_plate, middle = middle_plate;
  int pulls = 2;           ///< to the rims, before the fine grid
  std::size_t stride = 2;  ///< of the rays, in flows and pulls
  float last_step = 1.0f;  ///< along all rays, for the rims that the fine grid is fitted to
  std::span<const RimFit> fits = all_fits;
  Flatness flatness{.anywhere = 0.2f, .at_rims = 0.07f};  ///< of the triangles
};

inline Recipe recipe_of(const RefineSettings& settings) {
  Recipe recipe;
  if (settings.quality == RefineQuality::fast) {
    recipe.flows = 4;
    recipe.flow_step = 1.0f;
    recipe.coarse_plates = 2;
    recipe.plates = 1;
    recipe.coarse.steps = 10;  // which solve stiffer plates
    recipe.coarse.tie = 0.5f;
    recipe.middle.steps = 8;
    recipe.pulls = 1;
    recipe.fits = fewer_fits;
    recipe.flatness = {.anywhere = 0.25f, .at_rims = 0.09f};
  }
  if (settings.quality == RefineQuality::fine) recipe.cell = 0.016;
  if (settings.cell > 0.0) recipe.cell = settings.cell;
  // Fewer steps, or more cells from rim to rim, want more to go by.
  if (settings.quality == RefineQuality::fast || recipe.cell < 0.02) {
    recipe.coarse.stride = 2;
    recipe.middle.band = 2.5f;
    recipe.last_step = 0.5f;
  }
  return recipe;
}

}  // namespace polyhull::refine
