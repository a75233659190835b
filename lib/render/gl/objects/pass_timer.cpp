// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/pass_timer.h"

#include "render/gl/objects/gl_objects.h"

namespace polyhull::gl {

const char* pass_name(Pass pass) {
  static constexpr const char* names[] = {"upload", "shadow-maps", "scene-depth", "shadow",
                                          "mirror", "subject",     "blend",       "read-back"};
  static_assert(std::size(names) == pass_count);
  return names[static_cast<std::size_t>(pass)];
}

bool PassTimer::available() {
  // GLES has timer queries only by extensions that many drivers lack; its GPU times stay unknown.
  if (available_ < 0) available_ = epoxy_is_desktop_gl() ? 1 : 0;
  return available_ == 1;
}

PassTimer::~PassTimer() {
  if (context_gone()) return;
  for (auto& frame : queries_)
    if (frame[0] != 0) glDeleteQueries(pass_count, frame.data());
}

void PassTimer::begin(Pass pass) {
  running_ = static_cast<std::size_t>(pass);
  watch_ = {};
  if (!available()) return;
  auto& queries = queries_[frame_];
  if (queries[0] == 0) glGenQueries(pass_count, queries.data());
  glBeginQuery(GL_TIME_ELAPSED, queries[running_]);
  pending_[frame_][running_] = true;
}

void PassTimer::end() {
  if (available()) glEndQuery(GL_TIME_ELAPSED);
  if (waits_) glFinish();
  cpu_[running_] += watch_.milliseconds();
}

void PassTimer::next_frame() {
  cpu_.fill(0.0);
  frame_ = (frame_ + 1) % frames;
  if (!available() || queries_[frame_][0] == 0) return;
  for (std::size_t pass = 0; pass < pass_count; ++pass) {
    if (!pending_[frame_][pass]) {
      gpu_[pass] = 0.0;
      continue;
    }
    pending_[frame_][pass] = false;
    GLint ready = 0;
    glGetQueryObjectiv(queries_[frame_][pass], GL_QUERY_RESULT_AVAILABLE, &ready);
    if (!ready) continue;
    GLuint64 nanoseconds = 0;
    glGetQueryObjectui64v(queries_[frame_][pass], GL_QUERY_RESULT, &nanoseconds);
    gpu_[pass] = 1e-6 * static_cast<double>(nanoseconds);
  }
}

}  // namespace polyhull::gl
