// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What OpenGL may say at any time, said when a test wants it: takes the place of glGetError in the
/// whole process, for one at a time.
#pragma once

#include <epoxy/gl.h>

namespace polyhull::testing {

class SayGlError {
 public:
  /// From the call after \p quiet ones on glGetError says \p error, \p times times. Where it says
  /// something else, too, OpenGL must have been asked before.
  SayGlError(GLenum error, int quiet, int times = 1) {
    said = error;
    before = quiet;
    left = times;
    true_one = epoxy_glGetError;
    epoxy_glGetError = say;
  }
  ~SayGlError() { epoxy_glGetError = true_one; }
  SayGlError(const SayGlError&) = delete;

 private:
  static GLenum say() {
    if (before > 0) {
      --before;
      return true_one();
    }
    if (left <= 0) return true_one();
    --left;
    return said;
  }
  static inline GLenum said = GL_NO_ERROR;
  static inline int before = 0, left = 0;
  static inline PFNGLGETERRORPROC true_one = nullptr;
};

}  // namespace polyhull::testing
