// SPDX-License-Identifier: LGPL-2.1-or-later
#include "environment/environment.h"
#include "render/gl/passes.h"

namespace polyhull {

void EnvironmentPass::upload(const std::shared_ptr<const Environment>& environment) {
  gl::bind_texture(0, GL_TEXTURE_2D, texture_.get());
  if (environment == shown_) return;
  const RadiancePicture& picture = environment->picture();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB9_E5, picture.width, picture.height, 0, GL_RGB, GL_FLOAT,
               picture.pixels.data());
  gl::texture_parameters(GL_TEXTURE_2D, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
  shown_ = environment;  // held, so that no other takes its address
}

void EnvironmentPass::draw(const PassInput& in, const Mat4& clip_from_scene) {
  const std::shared_ptr<const Environment>& environment = in.frame.scene->environment;
  if (!environment) return;
  upload(environment);
  if (!program_.made()) program_ = gl::Program("fullscreen.vert", "environment.frag");
  program_.use();
  program_.set("scene_from_clip", glm::mat4(glm::inverse(clip_from_scene)));
  program_.set("size", glm::vec2(in.frame.width, in.frame.height));
  program_.set("environment", 0);
  program_.set("turn", environment->turn());
  program_.set("sky", in.frame.sky * in.frame.exposure);
  glBindVertexArray(nothing_.get());
  glDisable(GL_DEPTH_TEST);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glEnable(GL_DEPTH_TEST);
}

}  // namespace polyhull
