// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Owners of OpenGL objects. Made, used and destroyed with the same context current (or one that
/// shares with it).
#pragma once

#include <epoxy/gl.h>

#include <utility>

#include "base/vector.h"

namespace polyhull::gl {

/// While one lives, the context of all objects that this thread destroys is gone: they are only
/// forgotten, since no OpenGL can be called without a context.
class ContextGone {
 public:
  ContextGone();
  ~ContextGone();
  ContextGone(const ContextGone&) = delete;
};
bool context_gone();

/// Owns one object name; Kind tells how it is made and deleted.
template <typename Kind>
class Object {
 public:
  Object() = default;
  ~Object() { reset(); }
  Object(Object&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  /// The name; the object is made on first use.
  GLuint get() {
    if (name_ == 0) Kind::make(&name_);
    return name_;
  }
  bool made() const { return name_ != 0; }
  void reset() {
    if (name_ != 0 && !context_gone()) Kind::remove(&name_);
    name_ = 0;
  }

 private:
  GLuint name_ = 0;
};

struct TextureKind {
  static void make(GLuint* name) { glGenTextures(1, name); }
  static void remove(const GLuint* name) { glDeleteTextures(1, name); }
};
struct BufferKind {
  static void make(GLuint* name) { glGenBuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteBuffers(1, name); }
};
struct FramebufferKind {
  static void make(GLuint* name) { glGenFramebuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteFramebuffers(1, name); }
};
struct RenderbufferKind {
  static void make(GLuint* name) { glGenRenderbuffers(1, name); }
  static void remove(const GLuint* name) { glDeleteRenderbuffers(1, name); }
};
struct VertexArrayKind {
  static void make(GLuint* name) { glGenVertexArrays(1, name); }
  static void remove(const GLuint* name) { glDeleteVertexArrays(1, name); }
};
struct SamplerKind {
  static void make(GLuint* name) { glGenSamplers(1, name); }
  static void remove(const GLuint* name) { glDeleteSamplers(1, name); }
};

using Texture = Object<TextureKind>;
using Buffer = Object<BufferKind>;
using Framebuffer = Object<FramebufferKind>;
using Renderbuffer = Object<RenderbufferKind>;
using VertexArray = Object<VertexArrayKind>;
using Sampler = Object<SamplerKind>;

/// Binds \p texture to texture unit \p unit. \p sampler 0: the texture's own parameters.
void bind_texture(int unit, GLenum target, GLuint texture, GLuint sampler = 0);

/// Gives the bound 2D texture nearest or linear filters and clamped edges.
void texture_parameters(GLenum target, GLenum filter);

/// Limits drawing and clearing to \p rectangle of the framebuffer.
void scissor(const Rectangle& rectangle);

/// Throws Error when the bound draw framebuffer is not complete; \p what names it.
void check_framebuffer(const char* what);

/// Forgets the errors that others have left in the current context.
void forget_errors();

/// Throws Error (unsupported) where OpenGL has run out of memory or lost the context since
/// forget_errors(): what was drawn is then not to be used.
void check_errors();

/// Whether the current context is OpenGL ES.
bool is_embedded();

/// Whether the current context is drawn by Mesa's software rasteriser.
bool is_software();

}  // namespace polyhull::gl
