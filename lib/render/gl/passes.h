// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The passes of a composite that keep something from frame to frame.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/frame.h"
#include "render/gl/pass_timer.h"
#include "render/gl/program.h"
#include "render/gl/scene_buffers.h"
#include "render/gl/scene_layers.h"
#include "render/gl/subject_buffers.h"
#include "render/gl/targets.h"
#include "render/gl/tiles.h"
#include "render/light_reach.h"

namespace polyhull {

/// What the passes of one frame share.
struct PassInput {
  const RenderFrame& frame;
  const RenderPlan& plan;
  const RenderSettings& settings;
  const SceneBuffers& scene;
  std::vector<SubjectBuffers>& subjects;  ///< as RenderPlan::subjects
  gl::PassTimer& timer;
};

/// The programs of shaders/hull.vert and hull.frag: subjects in the views' colours.
class SkinPrograms {
 public:
  /// Draws all subjects for eye \p eye (0: the viewport's, 1: the mirrored one); with \p plane, in
  /// all calls or none, what lies on its positive side.
  void draw(const PassInput& in, std::size_t eye, const glm::mat4& clip_from_scene,
            const glm::vec4* plane = nullptr);

  /// Draws the soft edges of all subjects, for the viewport, where draw() has left samples free.
  void draw_ribbons(const PassInput& in, const glm::mat4& clip_from_scene);

 private:
  gl::Program plain_, distorted_, plain_ribbon_, distorted_ribbon_;
};

/// Light that the subjects take away.
class ShadowPass {
 public:
  /// Draws the depth maps.
  void draw_maps(const PassInput& in);
  /// Draws the irradiance taken on \p layers' grid, in the tiles that may be shaded.
  void draw(const PassInput& in, SceneLayers& layers);
  /// The irradiance, 1/z, on the grid; 0 outside of the tiles.
  GLuint taken() { return taken_; }
  /// A texel a tile of the picture: 1 where subjects may shade it, of those under the plan's shadow;
  /// 0: all of those count as shaded (skipping off).
  GLuint tiles() { return skips_ ? may_.colour() : 0; }
  bool static_reused() const { return static_reused_; }

 private:
  struct StaticKey {
    std::shared_ptr<const Scene> scene;  // held, so that no other scene takes its address
    int size = 0;
    std::vector<Mat4> views;
    bool operator==(const StaticKey&) const = default;
  };
  struct ReachKey {
    int generation = 0;  // of the places
    Vec3f centre{0.0f}, forward{0.0f};
    bool operator==(const ReachKey&) const = default;
  };
  gl::Program& receiver(ShadowQuality quality);
  void draw_static_maps(const PassInput& in);
  void find_extents(const PassInput& in, SceneLayers& layers);
  void find_tiles(const PassInput& in, SceneLayers& layers);
  void draw_irradiance(const PassInput& in, SceneLayers& layers);
  void blur(const PassInput& in, const ShadowGrid& grid);
  void clear(gl::LightLayer& layer, const PassInput& in, const ShadowGrid& grid);

  gl::Program depth_of_hull_, depth_of_scene_, reach_program_, tiles_program_, blur_;
  gl::LightLayer asked_, gathered_, extents_, may_;
  GLuint taken_ = 0;
  gl::VertexArray nothing_;
  gl::Program receivers_[5];
  gl::DepthMaps subject_maps_, static_maps_;
  gl::Sampler compare_, nearest_;
  gl::Texture sums_;
  LightReach reach_;
  std::optional<ReachKey> reach_key_;
  TileDrawing drawing_;
  std::vector<Tile> shadowed_;  // tiles under the plan's shadow
  std::optional<StaticKey> static_key_;
  std::vector<LightView> views_, static_views_;
  bool static_reused_ = false, skips_ = true;
};

/// The subjects' image in the plan's mirror, and what the mirror showed there.
class MirrorPass {
 public:
  /// \p scene_depth is the viewport's, over the whole picture; \p background its picture.
  void draw(const PassInput& in, GLuint background, GLuint scene_depth);
  GLuint image() { return image_.texture(); }
  GLuint shown() { return shown_.colour(); }

 private:
  gl::Program depth_, clipped_depth_, scene_;
  SkinPrograms skin_;
  gl::EdgeLayer image_;
  gl::LightLayer shown_;
};

/// What of the picture's tiles is drawn with the same layers.
struct BlendTiles {
  bool mirror = false, subject = false;
  std::vector<Tile> tiles;
};

/// The tiles that the plan's layers touch, by the layers; those that only the shadow may touch last.
std::vector<BlendTiles> blend_tiles(const PassInput& in);

}  // namespace polyhull
