// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What of the scene's surfaces the passes ask for, drawn once for each view of it and kept: its depth,
/// its normals, and what it scatters.
#pragma once

#include <memory>
#include <optional>

#include "render/frame.h"
#include "render/gl/program.h"
#include "render/gl/scene_buffers.h"
#include "render/gl/targets.h"

namespace polyhull {

/// Where the shadow is computed: every `step` pixels of every `step` rows of the picture.
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

  GLuint depth() { return layer_.depth(); }
  /// Albedo / pi, 1/z. Only with a shadow.
  GLuint albedo() { return layer_.colour(0); }
  /// What of the picture is drawn.
  const Rectangle& part() const { return part_; }
  const ShadowGrid& grid() const { return key_->grid; }
  /// Counts the draws: another number, other places.
  int generation() const { return generation_; }

  /// Sets the uniforms of shaders/place.glsl, whose textures go to \p unit and the next.
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
  std::optional<Key> key_;
  Rectangle part_;  // of the picture that is drawn
  gl::LightLayer layer_;
  gl::Program depth_, surface_;
  int generation_ = 0;
};

}  // namespace polyhull
