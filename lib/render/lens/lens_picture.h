// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A composite through the viewport's lens: what lies between a background, a renderer that knows
/// pinhole cameras alone, and the picture that goes out. In this order, each left out where it
/// changes nothing:
///
///   background -> overscan -> the renderer's composite -> depth of field -> motion blur
///              -> back through the distortion -> fall-off and grain
///
/// A background is the picture as its camera took it, distortion included (distorted_view.h).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "render/frame.h"
#include "render/lens/depth_layers.h"
#include "render/lens/depth_of_field.h"
#include "render/lens/distorted_view.h"
#include "render/lens/motion_blur.h"
#include "render/lens/sensor.h"
#include "scene/viewport_lens.h"

namespace polyhull {

class LensPicture {
 public:
  /// From now on \p frame's viewport with \p lens; \p before is the viewport that
  /// ViewportLens::shutter counts from, null where that is not known. Where the lens distorts, width,
  /// height, viewport and depth of \p frame become those that a renderer is to plan and draw: of a
  /// pinhole.
  /// Throws Error as DistortedView, and where \p lens is out of its ranges.
  void set(RenderFrame& frame, const ViewportLens& lens, const Camera* before = nullptr);

  /// Whether anything is to be done; else the renderer draws alone.
  bool active() const { return distorted_.active() || wanted(); }

  /// Whether the viewport moves while the shutter is open, so that it is seen.
  bool moves() const { return moves_; }

  /// Whether pixels change that RenderPlan::changed() of \p plan does not name.
  bool finishes(const RenderPlan& plan) const { return Sensor::wanted(lens_) || blurs(plan); }

  /// Renderer::render() with the frame as set() left it.
  using Compose =
      std::function<void(const RenderPlan& plan, const std::uint8_t* background,
                         int background_stride, std::uint8_t* target, int target_stride)>;

  /// Brings the composite into \p target, which holds \p background already or is the same memory:
  /// RGBA rows of the picture. \p frame is the one that set() made, \p plan its plan, or none where
  /// there is no subject; \p compose is called unless that is untouched: for blur once for what the
  /// subject does to the scene, and once for the subject. \p number is the frame's, for its
  /// grain.
  void draw(const RenderFrame& frame, const RenderPlan& plan, std::uint64_t number,
            const std::uint8_t* background, int background_stride, std::uint8_t* target,
            int target_stride, const Compose& compose);

 private:
  bool wanted() const { return Sensor::wanted(lens_) || DepthOfField::wanted(lens_) || moves_; }
  // Where the subject alone is blurred, one has to be in the picture.
  bool focuses(const RenderPlan& plan) const {
    return DepthOfField::wanted(lens_) && !(lens_.subject_only && plan.subject.empty());
  }
  bool moves(const RenderPlan& plan) const {
    return moves_ && !(lens_.still_background && plan.subject.empty());
  }
  bool blurs(const RenderPlan& plan) const { return focuses(plan) || moves(plan); }
  void blur(const RenderFrame& frame, const RenderPlan& plan, const std::uint8_t* background,
            int background_stride, std::uint8_t* target, int target_stride, const Compose& compose);

  Camera viewport_;
  ViewportLens lens_;
  DistortedView distorted_;
  DepthLayers depths_;
  DepthOfField depth_of_field_;
  MotionBlur motion_blur_;
  MotionBlur::Shutter shutter_;
  bool moves_ = false;
  std::vector<std::uint8_t> scene_, full_;  // sharp: without the subject before it, and with it
  LightLayers sharp_, focused_, moved_;     // their light, and what becomes of it
  Sensor sensor_;
};

}  // namespace polyhull
