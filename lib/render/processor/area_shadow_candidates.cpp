// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of the grid a subject may shade, and what they are of.
#include <algorithm>

#include "render/processor/area_shadow.h"

namespace polyhull::processor {
namespace {

/// Where pixel (x, y) of the picture lies in the light's map, as deep as 1 / \p inverse.
LightReach::Place place_of(const LightReach& reach, const ShadowView& view, int x, int y,
                           float inverse) {
  return reach.place(view.eye + view.rays.at(x, y) / inverse);
}

}  // namespace

/// Whether a subject may shade any of the block's pixels.
bool AreaShadow::may_shade(const LightReach& reach, const ShadowView& view, std::size_t number) {
  if (block_known_[number] < 1) {
    block_known_[number] = 1;
    find_depths(view, number);
  }
  if (block_known_[number] < 2) {
    block_known_[number] = 2;
    extents_[number] = extent_of(reach, view, number);
  }
  return reach.may_shade(extents_[number]);
}

void AreaShadow::find_depths(const ShadowView& view, std::size_t number) {
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    inverse_[pixel] = *view.layer.middle_inverse(step_ * x, step_ * y);
  });
}

/// Whether what the block has is to be seen at all. Where none of the pixels up to those that are
/// gathered show the mirror, nobody asks what is found there.
bool AreaShadow::is_seen(const ShadowView& view, std::size_t number) const {
  if (!view.mirror) return true;
  const Rectangle part = pixels_of(number);
  const Rectangle pixels{step_ * part.x, step_ * part.y, step_ * part.width, step_ * part.height};
  return view.mirror->shows_mirror(surroundings(pixels, view.layer.view()));
}

/// Around the block's places in the light's map. What lies between the rays of four corners and
/// between two depths is a convex body, and so is its image, as long as all of it is before the
/// light.
LightReach::Extent AreaShadow::extent_of(const LightReach& reach, const ShadowView& view,
                                         std::size_t number) const {
  float least = 1e30f, most = 0.0f;
  for_pixels(number, [&](std::size_t pixel, int, int) {
    const float inverse = inverse_[pixel];
    least = inverse > 0.0f ? std::min(least, inverse) : least;
    most = std::max(most, inverse);
  });
  LightReach::Extent extent;
  if (most == 0.0f) return extent;
  const Rectangle part = pixels_of(number);
  bool before = true;
  for (const int x : {part.x, part.x + part.width - 1}) {
    for (const int y : {part.y, part.y + part.height - 1}) {
      for (const float inverse : {least, most}) {
        const LightReach::Place at = place_of(reach, view, step_ * x, step_ * y, inverse);
        before = before && at.inverse > 0.0f;
        extent.add(at);
      }
    }
  }
  if (before) return extent;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    if (inverse_[pixel] > 0.0f)
      extent.add(place_of(reach, view, step_ * x, step_ * y, inverse_[pixel]));
  });
  return extent;
}

/// Where the block's pixels lie in the light's map: that follows from their depths.
void AreaShadow::find_places(const LightReach& reach, const ShadowView& view, std::size_t number) {
  block_known_[number] = 3;
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    in_light_[pixel] = {};
    if (inverse_[pixel] > 0.0f)
      in_light_[pixel] = place_of(reach, view, step_ * x, step_ * y, inverse_[pixel]);
  });
}

/// Returns how many pixels of the block a subject may shade; what they are made of is asked for
/// these only.
int AreaShadow::find_candidates(const LightReach& reach, const TracedScene& scene,
                                const ShadowView& view, std::size_t number) {
  const bool any = block_state_[number] > 0 && is_seen(view, number);
  if (!any && blank_[number]) return 0;
  blank_[number] = !any;
  if (any && block_known_[number] < 3) find_places(reach, view, number);
  int count = 0;
  ReceiverFinder receivers(scene, view.layer, view.eye);
  for_pixels(number, [&](std::size_t pixel, int x, int y) {
    candidate_[pixel] = blocked_[pixel] = 0;
    sum_[pixel] = mean_[pixel] = gathered_[pixel] = 0.0f;
    if (!any || !(inverse_[pixel] > 0.0f) || !reach.may_shade(in_light_[pixel])) return;
    if (!known_[pixel]) {
      known_[pixel] = 1;
      receivers_[pixel] = receivers.at(step_ * x, step_ * y, view.rays.at(step_ * x, step_ * y));
      open_known_[pixel] = open_[pixel] = 0;
    }
    candidate_[pixel] = 1;
    ++count;
  });
  return count;
}

}  // namespace polyhull::processor
