// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/lens_picture.h"

#include <cmath>

#include "base/error.h"

namespace polyhull {
namespace {

void check(const ViewportLens& lens) {
  bool finite = std::isfinite(lens.aperture) && std::isfinite(lens.focus_distance) &&
                std::isfinite(lens.grain) && std::isfinite(lens.grain_size);
  for (const double a : lens.falloff) finite = finite && std::isfinite(a);
  if (finite && lens.aperture >= 0.0 && lens.focus_distance > 0.0 && lens.grain >= 0.0) return;
  throw Error(
      Error::Kind::bad_input,
      "The viewport's lens cannot be used: aperture and grain must be 0 or above, the focus "
      "distance above 0, and all of it finite.");
}

}  // namespace

void LensPicture::set(RenderFrame& frame, const ViewportLens& lens) {
  check(lens);
  lens_ = lens;
  if (frame.viewport.distortion.empty() && !finishes()) {
    distorted_.set(frame.viewport);
    return;
  }
  viewport_ = resized(frame.viewport, frame.width, frame.height);
  if (!distorted_.set(viewport_)) return;
  frame.viewport = distorted_.pinhole();
  frame.width = frame.viewport.width;
  frame.height = frame.viewport.height;
}

void LensPicture::draw(const RenderPlan& plan, std::uint64_t number, const std::uint8_t* background,
                       int background_stride, std::uint8_t* target, int target_stride,
                       const Compose& compose) {
  if (!plan.untouched()) {
    if (distorted_.active()) {
      // A mirror shows what may lie anywhere in the picture.
      const Camera& pinhole = distorted_.pinhole();
      const Rectangle all{0, 0, pinhole.width, pinhole.height};
      distorted_.take(background, background_stride, plan.mirror_index < 0 ? plan.changed() : all);
      compose(distorted_.before(), distorted_.stride(), distorted_.drawn(), distorted_.stride());
      distorted_.give(plan.changed(), target, target_stride);
    } else {
      compose(background, background_stride, target, target_stride);
    }
  }
  if (finishes()) sensor_.finish(lens_, viewport_, number, target, target_stride);
}

}  // namespace polyhull
