// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far away each pixel's scene and subjects are: what depth of field is made of, whatever draws the
/// pictures.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/frame.h"
#include "view/scene_on_screen.h"

namespace polyhull {

class DepthLayers {
 public:
  /// Of \p frame, whose viewport is taken for a pinhole, and its plan. The scene's are kept as long
  /// as scene and viewport stay, and of a new view RenderFrame::planes are taken.
  void set(const RenderFrame& frame, const RenderPlan& plan);

  /// Whether the last set() found the scene's as they were.
  bool scene_reused() const { return scene_reused_; }

  int width() const { return width_; }
  int height() const { return height_; }

  /// 1/z in metres (z along the optical axis) of the nearest that the scene has in a pixel, by four
  /// samples, row by row: a pixel that is smoothed between two things goes with the nearer one. 0: of
  /// nothing, as if without end. Where the frame's depth picture is ahead of it, what that has.
  const std::vector<float>& scene() const { return depth_.empty() ? scene_ : depth_; }

  /// 1/z of the nearest subject, the mean over the samples that show it, and the share of the pixel
  /// that does, by four samples; both 0 where there is none. Of a subject without triangles, what the
  /// rays meet that draw it from its silhouettes (processor/image_layer.h).
  const std::vector<float>& subject() const { return subject_; }
  const std::vector<float>& coverage() const { return coverage_; }

  /// Beyond it there is no subject.
  const Rectangle& part() const { return part_; }

 private:
  void draw_scene(const RenderFrame& frame, const Mat4& pixels);
  void add_depth(const RenderFrame& frame);
  void draw_subjects(const RenderPlan& plan, const Mat4& pixels);

  int width_ = 0, height_ = 0;
  std::shared_ptr<const Scene> scene_held_;
  std::optional<std::uint64_t> geometry_;  // geometry_key() of the scene, once it is asked for
  Mat4 pixels_{0.0};                       // of what scene_ is
  bool scene_reused_ = false;
  std::vector<float> scene_, subject_, coverage_;
  Rectangle part_;
  std::vector<float> depth_;  // scene_ with the frame's depth picture; empty where that has none
};

}  // namespace polyhull
