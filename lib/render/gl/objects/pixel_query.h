// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How many pixels are drawn.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace polyhull::gl {

/// Counts those of what is drawn between begin() and end(), each time, with the context current. OpenGL
/// ES cannot.
class PixelQuery {
 public:
  PixelQuery() = default;
  ~PixelQuery();
  PixelQuery(const PixelQuery&) = delete;

  /// Ends a count that an exception left open.
  void begin();
  void end();
  /// Forgets what is counted.
  void forget();
  /// All counts since the last take() or forget(); 0: not known. Waits until all is drawn.
  std::uint64_t take();

 private:
  std::vector<GLuint> names_;
  std::size_t begun_ = 0;  // of these
  bool open_ = false;
};

}  // namespace polyhull::gl
