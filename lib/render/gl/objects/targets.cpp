// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/targets.h"

#include <algorithm>

namespace polyhull::gl {

void EdgeLayer::resize(int width, int height, int samples) {
  if (width == width_ && height == height_ && samples == wanted_) return;
  wanted_ = samples;
  width_ = width;
  height_ = height;
  GLint most = 1;
  glGetIntegerv(GL_MAX_SAMPLES, &most);
  samples_ = std::min(samples, static_cast<int>(most));
  if (samples_ < 2) samples_ = 0;

  bind_texture(0, GL_TEXTURE_2D, texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_SRGB8_ALPHA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE,
               nullptr);
  texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, single_.get());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.get(), 0);

  // Left from when this one was drawn into: depth with other samples than the colour is an error.
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER, 0);

  glBindFramebuffer(GL_FRAMEBUFFER, samples_ ? multi_.get() : single_.get());
  glBindRenderbuffer(GL_RENDERBUFFER, depth_.get());
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, GL_DEPTH24_STENCIL8, width, height);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                            depth_.get());
  if (samples_) {
    glBindRenderbuffer(GL_RENDERBUFFER, colour_.get());
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples_, GL_SRGB8_ALPHA8, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, colour_.get());
  }
  check_framebuffer("subject's layer");
}

void EdgeLayer::begin(const Rectangle& part) {
  glBindFramebuffer(GL_FRAMEBUFFER, samples_ ? multi_.get() : single_.get());
  glViewport(0, 0, width_, height_);
  scissor(part);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glStencilMask(0xff);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
}

void EdgeLayer::resolve(const Rectangle& part) {
  if (!samples_) return;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, multi_.get());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, single_.get());
  scissor(part);
  // A multisampled source wants the same rectangle on both sides; the scissor may differ.
  const int x1 = part.x + part.width, y1 = part.y + part.height;
  glBlitFramebuffer(part.x, part.y, x1, y1, part.x, part.y, x1, y1, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
}

void LightLayer::resize(int width, int height, int colours, bool stencil) {
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
  GLenum targets[2] = {};
  for (int i = 0; i < colours; ++i) {
    targets[i] = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    bind_texture(0, GL_TEXTURE_2D, colours_[i].get());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16F, width, height, 0, GL_RGBA, GL_HALF_FLOAT, nullptr);
    texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, targets[i], GL_TEXTURE_2D, colours_[i].get(), 0);
  }
  glDrawBuffers(colours, targets);
  bind_texture(0, GL_TEXTURE_2D, depth_.get());
  if (stencil)
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH24_STENCIL8, width, height, 0, GL_DEPTH_STENCIL,
                 GL_UNSIGNED_INT_24_8, nullptr);
  else
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, width, height, 0, GL_DEPTH_COMPONENT,
                 GL_UNSIGNED_INT, nullptr);
  texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
  glFramebufferTexture2D(GL_FRAMEBUFFER,
                         stencil ? GL_DEPTH_STENCIL_ATTACHMENT : GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D,
                         depth_.get(), 0);
  check_framebuffer("half-float light layer");
}

void LightLayer::bind() {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
  glViewport(0, 0, width_, height_);
}

void PictureTexture::resize(int width, int height) {
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  bind_texture(0, GL_TEXTURE_2D, texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  texture_parameters(GL_TEXTURE_2D, GL_LINEAR);
}

void PictureTarget::attach(GLenum use, Framebuffer& framebuffer, GLuint picture) {
  glBindFramebuffer(use, framebuffer.get());
  glFramebufferTexture2D(use, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, picture, 0);
}

void PictureTarget::bind(GLuint picture) {
  attach(GL_FRAMEBUFFER, target_, picture);
  check_framebuffer("output texture");
}

void PictureTarget::copy(GLuint from, GLuint to, const Rectangle& part) {
  attach(GL_READ_FRAMEBUFFER, source_, from);
  attach(GL_DRAW_FRAMEBUFFER, target_, to);
  check_framebuffer("output texture");
  glDisable(GL_SCISSOR_TEST);
  const int x1 = part.x + part.width, y1 = part.y + part.height;
  glBlitFramebuffer(part.x, part.y, x1, y1, part.x, part.y, x1, y1, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
}

void PictureTarget::read() {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, target_.get());
}

void DepthMaps::resize(int size, int layers) {
  if (size == size_ && layers == layers_) return;
  size_ = size;
  layers_ = layers;
  bind_texture(0, GL_TEXTURE_2D_ARRAY, texture_.get());
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT24, size, size, layers, 0,
               GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, nullptr);
  texture_parameters(GL_TEXTURE_2D_ARRAY, GL_NEAREST);
}

void DepthMaps::begin(int layer) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
  glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, texture_.get(), 0, layer);
  const GLenum none = GL_NONE;
  glDrawBuffers(1, &none);
  glReadBuffer(GL_NONE);
  check_framebuffer("shadow map");
  glViewport(0, 0, size_, size_);
  glDisable(GL_SCISSOR_TEST);
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
}

}  // namespace polyhull::gl
