// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The layers that a composite is made in.
#pragma once

#include "render/gl/objects/gl_objects.h"

namespace polyhull::gl {

/// A multisampled sRGB colour buffer with depth and stencil, and the texture it is resolved into.
class EdgeLayer {
 public:
  /// Pixels; \p samples per pixel, 0 or 1: drawn straight into the texture. Throws Error where
  /// OpenGL refuses.
  void resize(int width, int height, int samples);
  void begin(const Rectangle& part);  ///< binds, limits to part, clears
  void resolve(const Rectangle& part);
  GLuint texture() { return texture_.get(); }
  int samples() const { return samples_; }

 private:
  Framebuffer multi_, single_;
  Renderbuffer colour_, depth_;
  Texture texture_;
  int width_ = 0, height_ = 0, samples_ = 0, wanted_ = -1;
};

/// One or two linear half-float colour textures with a depth texture.
class LightLayer {
 public:
  /// \p stencil, always the same: with a stencil buffer.
  void resize(int width, int height, int colours = 1, bool stencil = false);
  void bind();
  GLuint colour(int which = 0) { return colours_[which].get(); }
  GLuint depth() { return depth_.get(); }

 private:
  Framebuffer framebuffer_;
  Texture colours_[2], depth_;
  int width_ = 0, height_ = 0;
};

/// An RGBA texture of a picture.
class PictureTexture {
 public:
  void resize(int width, int height);
  GLuint get() { return texture_.get(); }

 private:
  Texture texture_;
  int width_ = 0, height_ = 0;
};

/// Draws into pictures' textures, and copies between them.
class PictureTarget {
 public:
  void bind(GLuint picture);
  void copy(GLuint from, GLuint to, const Rectangle& part);
  /// Binds what was drawn or copied into last for reading.
  void read();

 private:
  void attach(GLenum use, Framebuffer& framebuffer, GLuint picture);
  Framebuffer target_, source_;
};

/// Layers of depth maps in one array texture.
class DepthMaps {
 public:
  void resize(int size, int layers);
  void begin(int layer);  ///< binds and clears
  GLuint texture() { return texture_.get(); }
  int size() const { return size_; }

 private:
  Framebuffer framebuffer_;
  Texture texture_;
  int size_ = 0, layers_ = 0;
};

}  // namespace polyhull::gl
