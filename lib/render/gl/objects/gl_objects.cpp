// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/gl_objects.h"

#include <string>
#include <string_view>

#include "base/error.h"

namespace polyhull::gl {
namespace {

thread_local bool gone = false;

// A lost context may report errors for ever.
constexpr int most_errors = 16;

}  // namespace

ContextGone::ContextGone() {
  gone = true;
}

ContextGone::~ContextGone() {
  gone = false;
}

bool context_gone() {
  return gone;
}

void forget_errors() {
  for (int i = 0; i < most_errors && glGetError() != GL_NO_ERROR; ++i) {
  }
}

void check_errors() {
  for (int i = 0; i < most_errors; ++i) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) return;
    if (error == GL_OUT_OF_MEMORY)
      throw Error(Error::Kind::unsupported,
                  "The graphics processor's memory is not enough for this picture.");
    if (error == GL_CONTEXT_LOST)
      throw Error(Error::Kind::unsupported,
                  "The graphics processor was reset and the OpenGL context is lost.");
  }
}

void bind_texture(int unit, GLenum target, GLuint texture, GLuint sampler) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glBindTexture(target, texture);
  glBindSampler(static_cast<GLuint>(unit), sampler);
}

void texture_parameters(GLenum target, GLenum filter) {
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void scissor(const Rectangle& rectangle) {
  glEnable(GL_SCISSOR_TEST);
  glScissor(rectangle.x, rectangle.y, rectangle.width, rectangle.height);
}

void check_framebuffer(const char* what) {
  const GLenum status = glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(Error::Kind::unsupported,
                "OpenGL on this machine cannot draw into the {} (framebuffer status {}).", what,
                status);
  }
}

bool is_embedded() {
  return !epoxy_is_desktop_gl();
}

bool is_software() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return renderer != nullptr &&
         std::string_view(renderer).find("llvmpipe") != std::string_view::npos;
}

}  // namespace polyhull::gl
