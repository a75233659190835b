// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/pixel_query.h"

#include "render/gl/objects/gl_objects.h"

namespace polyhull::gl {

PixelQuery::~PixelQuery() {
  if (!context_gone() && name_ != 0) glDeleteQueries(1, &name_);
}

void PixelQuery::begin() {
  if (is_embedded()) return;
  end();
  if (name_ == 0) glGenQueries(1, &name_);
  glBeginQuery(GL_SAMPLES_PASSED, name_);
  open_ = pending_ = true;
}

void PixelQuery::end() {
  if (open_) glEndQuery(GL_SAMPLES_PASSED);
  open_ = false;
}

std::uint64_t PixelQuery::take() {
  if (!pending_) return 0;
  pending_ = false;
  GLuint count = 0;
  glGetQueryObjectuiv(name_, GL_QUERY_RESULT, &count);
  return count;
}

}  // namespace polyhull::gl
