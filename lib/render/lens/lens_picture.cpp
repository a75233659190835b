// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/lens_picture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/error.h"

namespace polyhull {
namespace {

void check(const ViewportLens& lens) {
  bool finite = std::isfinite(lens.aperture) && std::isfinite(lens.focus_distance) &&
                std::isfinite(lens.shutter) && std::isfinite(lens.grain) &&
                std::isfinite(lens.grain_size);
  for (const double a : lens.falloff) finite = finite && std::isfinite(a);
  if (finite && lens.aperture >= 0.0 && lens.aperture <= 1.0 && lens.focus_distance >= 1e-3 &&
      lens.shutter >= 0.0 && lens.shutter <= 1.0 && lens.grain >= 0.0)
    return;
  throw Error(Error::Kind::bad_input,
              "The viewport's lens cannot be used: the aperture must be 0 to 1 m, the focus "
              "distance 1 mm or "
              "above, the shutter's share 0 to 1, grain 0 or above, and all of it finite. Got "
              "aperture {} m, focus distance {} m, "
              "shutter {}, grain {}.",
              lens.aperture, lens.focus_distance, lens.shutter, lens.grain);
}

/// Whether any of the plan's mirrors shows what may lie anywhere in the picture: metal gives all light, so that
/// nobody asks what it showed.
bool looks_elsewhere(const RenderFrame& frame, const RenderPlan& plan) {
  return std::any_of(plan.mirrors.begin(), plan.mirrors.end(), [&](const SeenMirror& seen) {
    return !seen.image.empty() && !only_mirrors(*frame.scene, seen);
  });
}

}  // namespace

void LensPicture::set(RenderFrame& frame, const ViewportLens& lens, const Camera* before) {
  check(lens);
  lens_ = lens;
  moves_ = false;
  if (before != nullptr && lens.shutter > 0.0) {
    shutter_ = {resized(*before, frame.width, frame.height), lens.shutter, lens.still_background};
    moves_ = MotionBlur::moves(resized(frame.viewport, frame.width, frame.height), shutter_);
  }
  if (frame.viewport.distortion.empty() && !wanted()) {
    distorted_.set(frame.viewport);
    return;
  }
  viewport_ = resized(frame.viewport, frame.width, frame.height);
  if (!distorted_.set(viewport_)) return;
  frame.viewport = distorted_.pinhole();
  frame.width = frame.viewport.width;
  frame.height = frame.viewport.height;
  // Without subjects and blur nobody asks for it.
  if (frame.depth && (wanted() || !frame.subjects.empty()))
    frame.depth = distorted_.take(*frame.depth);
  // The overscan's pixels are those of a pinhole's picture, moved and scaled.
  shutter_.before.K = frame.viewport.K * glm::inverse(viewport_.K) * shutter_.before.K;
}

/// The composite with depth of field and motion blur, of pinhole pictures of \p frame's size.
void LensPicture::blur(const RenderFrame& frame, const RenderPlan& plan,
                       const std::uint8_t* background, int background_stride, std::uint8_t* target,
                       int target_stride, const Compose& compose) {
  const int stride = 4 * frame.width;
  const std::size_t row = 4 * static_cast<std::size_t>(frame.width);
  // What a renderer writes of a picture is to hold all of it.
  const auto copy = [&](const std::uint8_t* from, int from_stride, std::vector<std::uint8_t>& to) {
    to.resize(row * static_cast<std::size_t>(frame.height));
    for (int y = 0; y < frame.height; ++y)
      std::memcpy(&to[static_cast<std::size_t>(y) * row],
                  from + static_cast<std::ptrdiff_t>(y) * from_stride, row);
  };
  RenderPlan around = plan, subject = plan;
  around.subject = {};
  subject.shadow = {};
  subject.lights.clear();
  // The mirrors' eyes stay: what is made ready for them serves both.
  for (SeenMirror& seen : subject.mirrors) seen.image = seen.shadow = {};
  copy(background, background_stride, scene_);
  if (!around.untouched()) compose(around, background, background_stride, scene_.data(), stride);
  const std::uint8_t* full = scene_.data();
  if (!subject.untouched()) {
    copy(full, stride, full_);
    compose(subject, full, stride, full_.data(), stride);
    full = full_.data();
  }
  depths_.set(frame, plan);
  const Camera camera = resized(frame.viewport, frame.width, frame.height);
  sharp_.read(depths_, {scene_.data(), full, stride});
  const LightLayers* light = &sharp_;
  const bool moving = moves(plan);
  if (focuses(plan)) {
    depth_of_field_.apply(camera, lens_, depths_, sharp_, moving, focused_);
    light = &focused_;
  }
  if (moving) {
    motion_blur_.apply(camera, shutter_, depths_, *light, moved_);
    light = &moved_;
  }
  light->write(full, stride, target, target_stride);
}

void LensPicture::draw(const RenderFrame& frame, const RenderPlan& plan, std::uint64_t number,
                       const std::uint8_t* background, int background_stride, std::uint8_t* target,
                       int target_stride, const Compose& compose) {
  const bool blurred = blurs(plan);
  if (!distorted_.active()) {
    if (blurred)
      blur(frame, plan, background, background_stride, target, target_stride, compose);
    else if (!plan.untouched())
      compose(plan, background, background_stride, target, target_stride);
  } else if (blurred || !plan.untouched()) {
    const Camera& pinhole = distorted_.pinhole();
    const Rectangle all{0, 0, pinhole.width, pinhole.height};
    const Rectangle changed = blurred ? all : plan.changed();
    distorted_.take(background, background_stride, looks_elsewhere(frame, plan) ? all : changed);
    const std::uint8_t* before = distorted_.before();
    std::uint8_t* drawn = distorted_.drawn();
    const int stride = distorted_.stride();
    if (blurred)
      blur(frame, plan, before, stride, drawn, stride, compose);
    else
      compose(plan, before, stride, drawn, stride);
    distorted_.give(changed, target, target_stride);
  }
  if (Sensor::wanted(lens_)) sensor_.finish(lens_, viewport_, number, target, target_stride);
}

}  // namespace polyhull
