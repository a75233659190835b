// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The OpenGL side of composite: a context shared with the neighbours, and a Compositor that lives
/// and works on the context's own thread.
#pragma once

#include <gst/gl/gl.h>

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "render/gl/compositor.h"

GST_DEBUG_CATEGORY_EXTERN(composite_debug);
#define GST_CAT_DEFAULT composite_debug

namespace polyhull::element {

/// Where the environment names no display and no way to OpenGL, sets GST_GL_PLATFORM=egl and
/// GST_GL_WINDOW=egl-device: what GStreamer 1.22 chooses by itself there crashes. To be called
/// before other threads run.
void prefer_egl_device_without_display();

/// The context of one element. Made when it is first needed.
class CompositeGl {
 public:
  explicit CompositeGl(GstElement* element) : element_(element) {}
  ~CompositeGl();
  CompositeGl(const CompositeGl&) = delete;

  /// The element's set_context().
  void set_context(GstContext* context);

  /// Answers a context query; false: it is not about OpenGL.
  bool answer(GstQuery* query);

  /// Finds or makes a context and the compositor. Throws Error that says what was refused.
  void ensure();

  /// Whether a graphics processor draws here; has the context ready then. Does not try where this
  /// machine has no such device.
  bool has_hardware();

  /// Lets go of the compositor and the context, which may be gone by itself.
  void release();

  /// The compositor's plan, after ensure(). Needs no OpenGL. Throws Error as Renderer::plan().
  RenderPlan plan(const RenderFrame& frame, const RenderSettings& settings) {
    return compositor_->plan(frame, settings);
  }

  /// Calls \p work with the compositor, after ensure(), on the context's thread and waits.
  /// Exceptions come through; Error (unsupported) where the context is gone.
  void run(const std::function<void(Compositor&)>& work);

  GstGLContext* context() const { return context_; }
  GstElement* element() const { return element_; }

 private:
  void find_context();
  void make_context();

  GstElement* element_;
  std::recursive_mutex mutex_;  // protects the pointers below against context queries
  GstGLDisplay* display_ = nullptr;
  GstGLContext* other_ = nullptr;    // of the application
  GstGLContext* context_ = nullptr;  // the one in use
  std::unique_ptr<Compositor> compositor_;
  std::optional<bool> hardware_;
};

}  // namespace polyhull::element
