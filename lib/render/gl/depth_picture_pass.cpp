// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/depth_picture.h"
#include "render/gl/passes.h"

namespace polyhull {

void DepthPicturePass::upload(const std::shared_ptr<const DepthPicture>& picture) {
  gl::bind_texture(0, GL_TEXTURE_2D, texture_.get());
  if (picture == shown_) return;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, picture->width, picture->height, 0, GL_RED, GL_FLOAT,
               picture->inverse.data());
  gl::texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
  shown_ = picture;  // held, so that no other takes its address
}

void DepthPicturePass::draw(const PassInput& in) {
  if (!in.frame.depth) return;
  upload(in.frame.depth);
  if (!program_.made()) program_ = gl::Program("fullscreen.vert", "depth_picture.frag");
  const Vec2 from_depth = inverse_from_depth(in.plan.clip_from_scene);
  program_.use();
  program_.set("inverse", 0);
  program_.set("size", glm::vec2(in.frame.width, in.frame.height));
  program_.set("depth_from_inverse", glm::vec2(1.0 / from_depth.x, -from_depth.y / from_depth.x));
  glBindVertexArray(nothing_.get());
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  // Which samples are ahead of the scene's by enough, and there what it is.
  glEnable(GL_STENCIL_TEST);
  glStencilFunc(GL_ALWAYS, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  glDepthMask(GL_FALSE);
  program_.set("nearness", 1.0f - depth_picture_ahead);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glStencilFunc(GL_EQUAL, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  glDepthMask(GL_TRUE);
  glDepthFunc(GL_ALWAYS);
  program_.set("nearness", 1.0f);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDepthFunc(GL_LESS);
  glDisable(GL_STENCIL_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

}  // namespace polyhull
