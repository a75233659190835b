// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/composite/gl.h"

#include <exception>
#include <filesystem>
#include <mutex>
#include <utility>

#include "base/error.h"
#include "plugins/common/object_lock.h"
#include "render/gl/objects/gl_objects.h"

namespace polyhull::element {
namespace {

Error refusal(const std::string& reason) {
  return Error(
      Error::Kind::unsupported,
      "There is no OpenGL context to be had ({}). Let the processor draw (pictures in system "
      "memory, and not backend=gl), or check that OpenGL works here; GST_GL_PLATFORM and "
      "GST_GL_WINDOW in the environment choose the way to it, such as egl and egl-device "
      "on machines without a display.",
      reason);
}

struct Job {
  const std::function<void()>* work;
  std::exception_ptr thrown;
};

void run_job(GstGLContext*, gpointer data) {
  auto* job = static_cast<Job*>(data);
  try {
    (*job->work)();
  } catch (...) {
    job->thrown = std::current_exception();
  }
}

/// On the context's thread, where it is always current unless it is gone: throws Error then.
void make_current(GstGLContext* context) {
  const guintptr own = gst_gl_context_get_gl_context(context);
  const GstGLPlatform platform = gst_gl_context_get_gl_platform(context);
  const auto is_current = [&] {
    return own != 0 && gst_gl_context_get_current_gl_context(platform) == own;
  };
  if (is_current() || (gst_gl_context_activate(context, TRUE) && is_current())) return;
  throw Error(Error::Kind::unsupported, "The OpenGL context is gone: it cannot be made current.");
}

/// On the context's thread; exceptions come through. One at a time in this process where Mesa's
/// software rasteriser draws: each of its contexts looks into the lists of all others without a
/// lock when it samples or maps a texture (lp_setup_is_resource_referenced, Mesa 22.3), and crashes
/// when another one is drawing.
void on_thread(GstGLContext* context, const std::function<void()>& work) {
  static std::mutex software_rasteriser;
  const std::function<void()> alone = [&] {
    make_current(context);
    std::unique_lock lock(software_rasteriser, std::defer_lock);
    if (gl::is_software()) lock.lock();
    work();
  };
  Job job{&alone, nullptr};
  gst_gl_context_thread_add(context, run_job, &job);
  if (job.thrown) std::rethrow_exception(job.thrown);
}

/// Whether the system has a device file of a graphics processor.
bool device_at_hand() {
  std::error_code problem;
  for (const char* file : {"/dev/nvidiactl", "/dev/mali0", "/dev/kgsl-3d0", "/dev/dxg"})
    if (std::filesystem::exists(file, problem)) return true;
  for (const auto& entry : std::filesystem::directory_iterator("/dev/dri", problem))
    if (entry.path().filename().string().starts_with("renderD")) return true;
  return false;
}

}  // namespace

void prefer_egl_device_without_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "GST_GL_PLATFORM", "GST_GL_WINDOW"})
    if (g_getenv(name)) return;
  g_setenv("GST_GL_PLATFORM", "egl", FALSE);
  g_setenv("GST_GL_WINDOW", "egl-device", FALSE);
}

CompositeGl::~CompositeGl() {
  release();
  gst_clear_object(&other_);
  gst_clear_object(&display_);
}

void CompositeGl::set_context(GstContext* context) {
  const std::scoped_lock lock(mutex_);
  gst_gl_handle_set_context(element_, context, &display_, &other_);
  if (display_)
    gst_gl_display_filter_gl_api(display_,
                                 static_cast<GstGLAPI>(GST_GL_API_OPENGL3 | GST_GL_API_GLES2));
}

bool CompositeGl::answer(GstQuery* query) {
  const std::scoped_lock lock(mutex_);
  return gst_gl_handle_context_query(element_, query, display_, context_, other_);
}

void CompositeGl::find_context() {
  // Neighbours ask us for the same at the same time: not under the lock.
  if (!gst_gl_ensure_element_data(element_, &display_, &other_))
    throw refusal("there is no display that OpenGL can use");
  gst_gl_display_filter_gl_api(display_,
                               static_cast<GstGLAPI>(GST_GL_API_OPENGL3 | GST_GL_API_GLES2));
  GstGLContext* found = nullptr;
  gst_gl_query_local_gl_context(element_, GST_PAD_SRC, &found);
  if (!found) gst_gl_query_local_gl_context(element_, GST_PAD_SINK, &found);
  if (found && found->display != display_) gst_clear_object(&found);
  const std::scoped_lock lock(mutex_);
  context_ = found;
}

void CompositeGl::make_context() {
  GstGLContext* context = nullptr;
  g_autoptr(GError) problem = nullptr;
  {
    const ObjectLock lock(display_);
    context = gst_gl_display_get_gl_context_for_thread(display_, nullptr);
    while (!context && !problem) {
      if (!gst_gl_display_create_context(display_, other_, &context, &problem)) break;
      // Another element may have been quicker.
      if (gst_gl_display_add_context(display_, context)) break;
      gst_clear_object(&context);
      context = gst_gl_display_get_gl_context_for_thread(display_, nullptr);
    }
  }
  if (!context) throw refusal(problem ? problem->message : "no reason was given");
  const std::scoped_lock lock(mutex_);
  context_ = context;
}

void CompositeGl::ensure() {
  if (compositor_) return;
  if (!context_) find_context();
  if (!context_) make_context();
  on_thread(context_, [this] { compositor_ = std::make_unique<Compositor>(); });
}

bool CompositeGl::has_hardware() {
  if (hardware_ == false) return false;
  if (!hardware_ && !device_at_hand()) hardware_ = false;
  if (hardware_ == false) return false;
  try {
    ensure();
    if (!hardware_) on_thread(context_, [this] { hardware_ = !gl::is_software(); });
  } catch (const Error& error) {
    GST_INFO_OBJECT(element_, "the processor draws: %s", error.what());
    hardware_ = false;
  }
  if (hardware_ == false) release();
  return *hardware_;
}

void CompositeGl::run(const std::function<void(Compositor&)>& work) {
  on_thread(context_, [&] { work(*compositor_); });
}

void CompositeGl::release() {
  try {
    if (compositor_) on_thread(context_, [this] { compositor_.reset(); });
  } catch (const Error& error) {
    GST_INFO_OBJECT(element_, "let go without OpenGL: %s", error.what());
    compositor_->abandon();
    compositor_.reset();
    const ObjectLock lock(display_);
    gst_gl_display_remove_context(display_, context_);  // nobody else shall find it there
  }
  const std::scoped_lock lock(mutex_);
  gst_clear_object(&context_);
}

}  // namespace polyhull::element
