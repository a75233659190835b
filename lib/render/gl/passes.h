// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The passes of a composite that keep something from frame to frame.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/frame.h"
#include "render/gl/objects/pass_timer.h"
#include "render/gl/objects/program.h"
#include "render/gl/objects/targets.h"
#include "render/gl/scene_buffers.h"
#include "render/gl/scene_layers.h"
#include "render/gl/subject_buffers.h"
#include "render/gl/tiles.h"
#include "render/light_reach.h"
#include "render/light_samples.h"
#include "render/shadow_recipe.h"
#include "render/subject_light.h"
#include "scene/spot_cone.h"

namespace polyhull {

/// A light whose shadow is drawn.
struct PassLight {
  const Light& light;
  const ShadowLight& planned;
  ShadowRecipe recipe;
  /// By what its irradiance, per power, is multiplied in textures of half floats: the sun's would be too
  /// small for them. A power of two, at most the square of the distance to the scene's box, so that
  /// nothing there overflows, and 1 for lamps, whose values stay as they are.
  float scale = 1.0f;
  glm::vec3 power{0.0f};  ///< over the scale, as a share of PassInput::power
};

/// What the passes of one frame share.
struct PassInput {
  const RenderFrame& frame;
  const RenderPlan& plan;
  const RenderSettings& settings;
  const SceneBuffers& scene;
  std::vector<SubjectBuffers>& subjects;  ///< as RenderPlan::subjects
  gl::PassTimer& timer;
  std::vector<PassLight> lights;  ///< as RenderPlan::lights
  glm::vec3 power{0.0f};          ///< of these together, each over its scale; times exposure
  bool translucent = false;       ///< the background may have an alpha below 1 that counts

  /// One look at each light's middle, at the picture's whole resolution.
  bool hard() const { return settings.shadow == ShadowQuality::hard; }
  /// Pixels of the picture from one of the shadows' grid to the next.
  int grid_step() const { return lights.empty() ? 0 : lights.front().recipe.map_step; }
};

/// The lights of \p in's plan.
void set_lights(PassInput& in);

/// As shaders/light.glsl takes it.
inline glm::vec2 shader_cone(const Light& light) {
  const SpotCone cone = cone_of(light);
  return {cone.scale, cone.offset};
}

/// Lamps that shaders/lamps.glsl adds up; how many it knows is its define.
inline constexpr std::size_t max_lamps = 32;
std::string lamps_define();

/// Sets the frame's lamps and even light for \p program, which includes lamps.glsl; where there are too many,
/// those that throw shadows come first, then those that give the subjects most.
void set_lamps(gl::Program& program, const PassInput& in);

/// The programs of shaders/hull.vert and hull.frag: subjects in the views' colours.
class SkinPrograms {
 public:
  /// Draws all subjects for eye \p eye (0: the viewport's, else SeenMirror::sight); with \p plane what
  /// lies on its positive side.
  void draw(const PassInput& in, std::size_t eye, const glm::mat4& clip_from_scene,
            const glm::vec4* plane = nullptr);

  /// Draws the soft edges of all subjects, for the viewport, where draw() has left samples free.
  void draw_ribbons(const PassInput& in, const glm::mat4& clip_from_scene);

 private:
  gl::Program& use(const PassInput& in, std::size_t s, const glm::mat4& clip_from_scene,
                   bool clipped, const char* kind);
  void place(const PassInput& in, std::size_t s, const glm::mat4& clip_from_scene,
             gl::Program& program);

  std::map<std::vector<std::string>, gl::Program> programs_;  // by what they define
  std::vector<std::pair<gl::Texture, std::shared_ptr<const LightLattice>>> lights_;  // by subject
};

/// The programs of shadow passes.
struct ShadowPrograms {
  gl::Program depth_of_hull, depth_of_scene;
  gl::Program reach, tiles, blur, touched;
  std::map<int, gl::Program> receivers;  ///< by ShadowRecipe::taps
  gl::Sampler compare, nearest;          ///< of depth maps
};

/// Depth maps of the subjects and of the scene, seen from a light that throws a shadow.
class ShadowMaps {
 public:
  /// \p shape: that of all subjects.
  void draw(const PassInput& in, const PassLight& light, const SubjectsShape& shape,
            ShadowPrograms& programs);
  /// Sets the maps and the light's cells for \p program, of shaders/shadow.frag, and binds them to
  /// units 0 to 2 with samplers of their own.
  void set(gl::Program& program, const PassLight& light, ShadowPrograms& programs);
  /// Where subjects can stand before the light.
  const LightReach::Map& reach() const { return reach_.map(); }
  /// LightReach::sums(); not where the map is everywhere.
  GLuint reach_sums() { return sums_.get(); }
  /// The widest texel of the subjects' maps, in tangents.
  float texel() const;
  bool static_reused() const { return static_reused_; }

 private:
  struct StaticKey {
    std::shared_ptr<const Scene> scene;  // held, so that no other scene takes its address
    int size = 0;
    std::vector<Mat4> views;
    bool operator==(const StaticKey&) const = default;
  };
  void find_reach(const Light& light, const SubjectsShape& shape);
  LightView scene_view(const PassInput& in, const PassLight& light, const Vec3& cell,
                       std::span<const Vec3f> subjects, double far) const;
  void draw_static_maps(const PassInput& in, const PassLight& light, ShadowPrograms& programs);

  gl::DepthMaps subject_maps_, static_maps_;
  gl::Texture sums_;
  LightReach reach_;
  std::optional<StaticKey> static_key_;
  std::vector<LightView> views_, static_views_;
  bool static_reused_ = false;
};

/// By light, those of PassInput::lights among them.
using LightMaps = std::map<std::size_t, ShadowMaps>;

/// Light that the subjects take away where a view of the scene looks.
class ShadowPass {
 public:
  explicit ShadowPass(ShadowPrograms& programs) : programs_(programs) {}
  /// Draws the irradiance taken on \p layers' grid, in the tiles of \p part (pixels) that may be
  /// shaded. \p cleared: where it is asked for.
  void draw(const PassInput& in, LightMaps& maps, SceneLayers& layers, const Rectangle& part,
            const Rectangle& cleared);
  /// The irradiance by channel, per PassInput::power, and 1/z, on the grid; 0 outside of the tiles.
  GLuint taken() { return taken_; }
  /// A texel a small tile of the picture: 0 where no light is missing, 1 where any is missing that
  /// can be seen; no texture: all tiles count as shaded (skipping off).
  GLuint touched() { return skips_ ? touched_.colour() : 0; }

 private:
  struct ReachKey {
    int generation = 0;  // of the places
    Vec3f centre{0.0f}, forward{0.0f};
    bool operator==(const ReachKey&) const = default;
  };
  /// Which tiles a light's shadow may be in.
  struct LightTiles {
    gl::LightLayer extents, may;
    std::optional<ReachKey> key;  // of the extents
  };
  gl::Program& receiver(int taps);
  void find_extents(const PassInput& in, const LightReach::Map& map, SceneLayers& layers,
                    LightTiles& own);
  void find_tiles(const PassInput& in, ShadowMaps& maps, SceneLayers& layers, LightTiles& own);
  void clear_tiles(gl::LightLayer& layer, const PassInput& in);
  void draw_irradiance(const PassInput& in, LightMaps& maps, SceneLayers& layers);
  void blur(const PassInput& in, const ShadowGrid& grid);
  void find_touched(const PassInput& in, const ShadowGrid& grid);
  /// Those of the tiles that subjects may shade of any light.
  TileChoice shaded() { return {skips_ ? may_.colour() : 0}; }
  void clear(gl::LightLayer& layer, const PassInput& in, const ShadowGrid& grid);

  ShadowPrograms& programs_;
  gl::LightLayer asked_, gathered_, may_, touched_;
  std::map<std::size_t, LightTiles> tiles_;  // by light
  GLuint taken_ = 0;
  gl::VertexArray nothing_;
  TileDrawing drawing_;
  Rectangle part_, cleared_;
  std::vector<Tile> shadowed_;  // tiles of the part
  bool skips_ = true;
};

/// What a background's maker tells of its depth (depth_picture.h), before the subjects are drawn.
class DepthPicturePass {
 public:
  /// Puts the frame's depth picture, where it has one, into the bound framebuffer's depth, which has
  /// the scene's and a cleared stencil buffer.
  void draw(const PassInput& in);

 private:
  void upload(const std::shared_ptr<const DepthPicture>& picture);

  gl::Program program_;
  gl::Texture texture_;
  gl::VertexArray nothing_;
  std::shared_ptr<const DepthPicture> shown_;
};

/// What is seen of the environment of the frame's scene, where it has one.
class EnvironmentPass {
 public:
  /// Puts it into the bound framebuffer, as \p clip_from_scene sees it.
  void draw(const PassInput& in, const Mat4& clip_from_scene);

 private:
  void upload(const std::shared_ptr<const Environment>& environment);

  gl::Program program_;
  gl::Texture texture_;
  gl::VertexArray nothing_;
  std::shared_ptr<const Environment> shown_;
};

/// The subjects' image in one of the plan's mirrors, and what the mirror showed there.
class MirrorPass {
 public:
  /// \p scene_depth is the viewport's, over the whole picture; \p background its picture.
  void draw(const PassInput& in, const SeenMirror& seen, GLuint background, GLuint scene_depth);
  GLuint image() { return image_.texture(); }
  GLuint shown() { return shown_.colour(); }

 private:
  void draw_image(const PassInput& in, const SeenMirror& seen);

  gl::Program clipped_depth_, scene_;
  EnvironmentPass environment_;
  MirrorStencil stencil_;
  SkinPrograms skin_;
  gl::EdgeLayer image_;
  gl::LightLayer shown_;
};

/// A mirror's layers, which are kept.
struct MirrorShadow {
  SceneLayers layers;  ///< the scene as it shows it
  ShadowPass shadow;   ///< on that
  explicit MirrorShadow(ShadowPrograms& programs) : shadow(programs) {}
};

/// What the blend puts together; layers of what the plan leaves out are not looked at.
struct BlendLayers {
  GLuint background;
  bool front;  ///< what is seen directly: subjects and their shadow; else only what a mirror shows
  SceneLayers& direct;
  ShadowPass& shadow;
  GLuint subject;
  const SeenMirror* seen;  ///< null: no mirror
  MirrorPass* mirror;      ///< its image
  MirrorShadow* in_mirror;
};

/// Puts the layers together (shaders/composite.frag).
class BlendPass {
 public:
  /// Draws the tiles that a layer touches into the bound framebuffer, which is of the picture's size;
  /// the others are to hold the background.
  void draw(const PassInput& in, const BlendLayers& layers);

 private:
  struct Kind {
    bool shadow = false, mirror_shadow = false, mirror = false, subject = false, fill = false;
  };
  gl::Program& program(const Kind& kind, int step);
  void set_layers(const PassInput& in, const BlendLayers& layers, const Kind& kind,
                  gl::Program& blend);

  gl::Program programs_[2][2][2][2][2][2];  // by the kind, in its order, and the grid's step - 1
  TileDrawing drawing_;
};

}  // namespace polyhull
