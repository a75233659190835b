// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// An OpenGL context without a window, for tests.
#pragma once

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <string>
#include <vector>

namespace polyhull::testing {

class HeadlessContext {
 public:
  /// Desktop OpenGL 3.3 core or OpenGL ES 3.0, current on this thread; ready() tells whether it
  /// worked.
  explicit HeadlessContext(bool embedded) {
    display_ = open_display();
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr)) {
      why_ = "no EGL display";
      return;
    }
    eglBindAPI(embedded ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
    const EGLint want[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                           embedded ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglChooseConfig(display_, want, &config, 1, &count) || count == 0) {
      why_ = "no EGL configuration";
      return;
    }
    const EGLint desktop[] = {EGL_CONTEXT_MAJOR_VERSION,
                              3,
                              EGL_CONTEXT_MINOR_VERSION,
                              3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                              EGL_NONE};
    const EGLint es[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, embedded ? es : desktop);
    if (context_ == EGL_NO_CONTEXT) {
      why_ = "no OpenGL context";
      return;
    }
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      why_ = "the context cannot be made current without a surface";
  }
  ~HeadlessContext() {
    if (display_ == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  }
  HeadlessContext(const HeadlessContext&) = delete;

  bool ready() const { return why_.empty(); }
  const std::string& why() const { return why_; }

 private:
  static EGLDisplay open_display() {
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") ||
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base")) {
      EGLDeviceEXT devices[8];
      EGLint count = 0;
      if (eglQueryDevicesEXT(8, devices, &count)) {
        for (EGLint i = 0; i < count; ++i) {
          const EGLDisplay display =
              eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr);
          if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr)) return display;
        }
      }
    }
    return eglGetDisplay(EGL_DEFAULT_DISPLAY);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  std::string why_;
};

}  // namespace polyhull::testing
