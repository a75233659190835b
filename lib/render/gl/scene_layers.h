// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What of the scene's surfaces the passes ask for, drawn once for each view of it and kept: its depth,
/// what it scatters, and on the shadow's grid its normals.
#pragma once

#include <memory>
#include <optional>

#include "render/frame.h"
#include "render/gl/program.h"
#include "render/gl/scene_buffers.h"
#include "render/gl/targets.h"

namespace polyhull {

/// Where the shadow is computed: every `step` pixels of the picture.
struct ShadowGrid {
  int step = 2, width = 0, height = 0;
  ShadowGrid() = default;
  ShadowGrid(const RenderFrame& frame, ShadowQuality quality);
  /// The grid's pixels under \p part of the picture, and \p border more on each side.
  Rectangle under(const Rectangle& part, int border) const;
  bool operator==(const ShadowGrid&) const = default;
};

class SceneLayers {
 public:
  /// Makes ready what \p plan's shadow and mirror ask for. Returns whether all of it was kept from
  /// before.
  bool draw(const RenderFrame& frame, const RenderPlan& plan, const RenderSettings& settings,
            const SceneBuffers& scene);

  /// Forgets all, where another scene comes.
  void forget() { key_.reset(); }

  GLuint depth() { return full_.depth(); }
  /// Of the whole resolution: albedo / pi, 1/z. Only with a shadow.
  GLuint albedo() { return full_.colour(); }
  /// What of the picture is drawn.
  const Rectangle& part() const { return part_; }
  const ShadowGrid& grid() const { return key_->grid; }
  /// On the grid: the normal to the eye's side, 1/z (0: nothing is there). Only with a shadow.
  GLuint normals() { return grid_.colour(); }
  GLuint grid_depth() { return grid_.depth(); }
  /// Counts the draws of the grid: another number, other places.
  int generation() const { return generation_; }

  /// Sets the uniforms of shaders/place.glsl; the grid's depth goes to \p unit.
  void set_places(gl::Program& program, const RenderFrame& frame, const RenderPlan& plan, int unit);

 private:
  struct Key {
    std::shared_ptr<const Scene> scene;  // held, so that no other scene takes its address
    Mat4 clip_from_scene{0.0};
    int width = 0, height = 0;
    bool shadow = false;
    ShadowGrid grid;
    bool operator==(const Key&) const = default;
  };
  void draw_full(const RenderPlan& plan, const SceneBuffers& scene);
  void draw_grid(const RenderPlan& plan, const SceneBuffers& scene);

  std::optional<Key> key_;
  Rectangle part_;  // of the picture that is drawn
  gl::LightLayer full_, grid_;
  gl::Program depth_, albedo_, normals_;
  int generation_ = 0;
};

}  // namespace polyhull
