// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/pixel_query.h"

#include "render/gl/objects/gl_objects.h"

namespace polyhull::gl {

PixelQuery::~PixelQuery() {
  if (!context_gone()) glDeleteQueries(static_cast<GLsizei>(names_.size()), names_.data());
}

void PixelQuery::begin() {
  if (is_embedded()) return;
  end();
  if (begun_ == names_.size()) glGenQueries(1, &names_.emplace_back());
  glBeginQuery(GL_SAMPLES_PASSED, names_[begun_++]);
  open_ = true;
}

void PixelQuery::end() {
  if (open_) glEndQuery(GL_SAMPLES_PASSED);
  open_ = false;
}

void PixelQuery::forget() {
  end();
  begun_ = 0;
}

std::uint64_t PixelQuery::take() {
  std::uint64_t all = 0;
  for (; begun_ > 0; --begun_) {
    GLuint count = 0;
    glGetQueryObjectuiv(names_[begun_ - 1], GL_QUERY_RESULT, &count);
    all += count;
  }
  return all;
}

}  // namespace polyhull::gl
