// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/lens_picture.h"

#include <cmath>
#include <cstring>

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

/// The composite with depth of field, of pinhole pictures of \p frame's size.
void LensPicture::focus(const RenderFrame& frame, const RenderPlan& plan,
                        const std::uint8_t* background, int background_stride, std::uint8_t* target,
                        int target_stride, const Compose& compose) {
  const int stride = 4 * frame.width;
  scene_.resize(static_cast<std::size_t>(stride) * static_cast<std::size_t>(frame.height));
  for (int y = 0; y < frame.height; ++y)
    std::memcpy(&scene_[static_cast<std::size_t>(y) * static_cast<std::size_t>(stride)],
                background + static_cast<std::ptrdiff_t>(y) * background_stride,
                static_cast<std::size_t>(stride));
  RenderPlan around = plan, subject = plan;
  around.subject = {};
  subject.shadow = subject.mirror = subject.mirror_shadow = {};
  subject.light = subject.mirror_index = -1;
  if (!around.untouched()) {
    full_ = scene_;  // what is read while the other is written
    compose(around, full_.data(), stride, scene_.data(), stride);
  }
  const std::uint8_t* full = scene_.data();
  if (!subject.untouched()) {
    full_ = scene_;
    compose(subject, scene_.data(), stride, full_.data(), stride);
    full = full_.data();
  }
  depths_.set(frame, plan);
  depth_of_field_.apply(resized(frame.viewport, frame.width, frame.height), lens_, depths_,
                        {scene_.data(), full, stride}, target, target_stride);
}

void LensPicture::draw(const RenderFrame& frame, const RenderPlan& plan, std::uint64_t number,
                       const std::uint8_t* background, int background_stride, std::uint8_t* target,
                       int target_stride, const Compose& compose) {
  const bool focuses = DepthOfField::wanted(lens_);
  if (!distorted_.active()) {
    if (focuses)
      focus(frame, plan, background, background_stride, target, target_stride, compose);
    else if (!plan.untouched())
      compose(plan, background, background_stride, target, target_stride);
  } else if (focuses || !plan.untouched()) {
    // A mirror shows what may lie anywhere in the picture.
    const Camera& pinhole = distorted_.pinhole();
    const Rectangle all{0, 0, pinhole.width, pinhole.height};
    distorted_.take(background, background_stride,
                    focuses || plan.mirror_index >= 0 ? all : plan.changed());
    const std::uint8_t* before = distorted_.before();
    std::uint8_t* drawn = distorted_.drawn();
    const int stride = distorted_.stride();
    if (focuses) {
      focus(frame, plan, before, stride, drawn, stride, compose);
      distorted_.give_all(target, target_stride);
    } else {
      compose(plan, before, stride, drawn, stride);
      distorted_.give(plan.changed(), target, target_stride);
    }
  }
  if (Sensor::wanted(lens_)) sensor_.finish(lens_, viewport_, number, target, target_stride);
}

}  // namespace polyhull
