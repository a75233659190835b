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
#include "render/gl/targets.h"
#include "render/gl/scene_buffers.h"
#include "render/gl/subject_buffers.h"

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

 private:
  gl::Program plain_, distorted_;
};

/// Light that the subjects take away.
class ShadowPass {
 public:
  /// Draws the depth maps.
  void draw_maps(const PassInput& in);
  /// Draws what is taken into \p light, whose depth is the scene's.
  void draw(const PassInput& in, gl::LightLayer& light);
  bool static_reused() const { return static_reused_; }

 private:
  struct StaticKey {
    std::shared_ptr<const Scene> scene;  // held, so that no other scene takes its address
    Light light;
    std::size_t cells = 0;
    bool operator==(const StaticKey&) const = default;
  };
  gl::Program& receiver(ShadowQuality quality);
  void draw_irradiance(const PassInput& in);
  void blur(const PassInput& in);

  gl::Program depth_of_hull_, depth_of_scene_, blur_, apply_;
  gl::LightLayer half_, gathered_;
  gl::VertexArray nothing_;
  gl::Program receivers_[5];
  gl::DepthMaps subject_maps_, static_maps_;
  gl::Sampler compare_, nearest_, smooth_;
  std::optional<StaticKey> static_key_;
  std::vector<LightView> views_, static_views_;
  bool static_reused_ = false;
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

}  // namespace polyhull
