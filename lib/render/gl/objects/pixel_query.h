// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How many pixels are drawn.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>

namespace polyhull::gl {

/// Counts those of what is drawn between begin() and end(), with the context current. OpenGL ES
/// cannot.
class PixelQuery {
 public:
  PixelQuery() = default;
  ~PixelQuery();
  PixelQuery(const PixelQuery&) = delete;

  /// Ends a count that an exception left open.
  void begin();
  void end();
  /// The count since begin(), once; 0: not known. Waits until it is drawn.
  std::uint64_t take();

 private:
  GLuint name_ = 0;
  bool open_ = false;
  bool pending_ = false;
};

}  // namespace polyhull::gl
