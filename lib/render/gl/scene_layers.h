// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What of the scene's surfaces the passes ask for, drawn once for each view of it and kept: its depth,
/// its normals, and what it scatters.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "render/frame.h"
#include "render/gl/objects/program.h"
#include "render/gl/objects/targets.h"
#include "render/gl/scene_buffers.h"

namespace polyhull {

/// Where the shadow is computed: every `step` pixels of every `step` rows of the picture.
struct ShadowGrid {
  int step = 0, width = 0, height = 0;
  ShadowGrid() = default;
  ShadowGrid(const RenderFrame& frame, int step);
  /// The grid's pixels under \p part of the picture, and \p border more on each side.
  Rectangle under(const Rectangle& part, int border) const;
  bool operator==(const ShadowGrid&) const = default;
};

/// Who sees the scene.
struct LayerView {
  Mat4 clip_from_scene{1.0};
  Vec3 eye{0.0};
  PixelRays rays;                  ///< from the eye through the picture's pixels
  std::vector<std::size_t> way{};  ///< in a mirror: SeenMirror::way
  Mat4 viewport_from_scene{1.0};   ///< in a mirror: clip_from_scene of the viewport itself
};

/// The viewport of \p plan.
LayerView direct_view(const RenderFrame& frame, const RenderPlan& plan);

/// The viewport's image in \p seen, a mirror of \p plan.
LayerView view_in_mirror(const RenderPlan& plan, const SeenMirror& seen);

/// Finds where mirrors are seen.
class MirrorStencil {
 public:
  /// Leaves the bound framebuffer's stencil test such that only those of its samples are drawn that
  /// show what the last mirror of \p way does, and its depth cleared; stencil and depth are to be
  /// cleared before. \p hide is called for each mirror on the way to the last, by its number there, to
  /// draw what else hides what it shows.
  void narrow(const Scene& scene, const SceneBuffers& buffers, const Mat4& clip_from_scene,
              const std::vector<std::size_t>& way,
              const std::function<void(std::size_t)>& hide = nullptr);

 private:
  gl::Program depth_, clipped_depth_;
};

/// 1/z = x * depth + y, of the depths that \p clip makes; its w is z.
Vec2 inverse_from_depth(const Mat4& clip);

class SceneLayers {
 public:
  /// Makes ready what \p view sees in the tiles of \p seen (pixels) and a little around them: the
  /// depth, and for a grid of \p step the rest, too (0: no grid). Returns whether all of it was kept from
  /// before, which \p skip allows.
  bool draw(const RenderFrame& frame, bool skip, const LayerView& view, const Rectangle& seen,
            int step, const SceneBuffers& scene);

  /// Forgets all, where another scene comes.
  void forget() { key_.reset(); }

  GLuint depth() { return layer_.depth(); }
  /// Albedo / pi, 1/z; in a mirror 0 where it is not seen. Only with a grid.
  GLuint albedo() { return layer_.colour(0); }
  /// Normals, 1/z. Only with a grid.
  GLuint normals() { return layer_.colour(1); }
  /// What of the picture is drawn.
  const Rectangle& part() const { return part_; }
  const ShadowGrid& grid() const { return key_->grid; }
  /// Counts the draws: another number, other places.
  int generation() const { return generation_; }

  /// Sets the uniforms of shaders/place.glsl, whose textures go to \p unit and the next.
  void set_places(gl::Program& program, int unit);

 private:
  void draw_surfaces(const RenderFrame& frame, const SceneBuffers& scene);
  struct Key {
    std::shared_ptr<const Scene> scene;  // held, so that no other scene takes its address
    Mat4 clip_from_scene{0.0};
    int width = 0, height = 0;
    ShadowGrid grid;
    bool operator==(const Key&) const = default;
  };
  std::optional<Key> key_;
  LayerView view_;
  Rectangle part_;  // of the picture that is drawn
  gl::LightLayer layer_;
  gl::Program depth_, surface_, clipped_surface_;
  MirrorStencil stencil_;
  int generation_ = 0;
};

}  // namespace polyhull
