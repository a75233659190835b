// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Parts of pictures on their way from OpenGL to memory, which nobody waits for until they are
/// wanted.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/vector.h"
#include "render/gl/objects/gl_objects.h"

namespace polyhull::gl {

/// How many of \p count pixels are not the same.
std::uint64_t pixels_that_differ(const std::uint8_t* a, const std::uint8_t* b, std::size_t count);

class PixelReadings {
 public:
  /// Starts reading \p part (maybe empty) of the bound read framebuffer, RGBA8: the place to take()
  /// it from, until the second start() after this one.
  unsigned start(const Rectangle& part);

  /// The place of the next start().
  unsigned next() const { return next_; }

  /// Waits until what was started at \p place is there, and writes it to its place in the picture
  /// \p target, whose rows are \p stride bytes apart. Returns how many pixels are others now. Throws
  /// Error (unsupported) where OpenGL fails.
  std::uint64_t take(unsigned place, std::uint8_t* target, int stride);

 private:
  struct Reading {
    Buffer pixels;
    std::size_t room = 0;  // bytes
    Rectangle part;
  };
  Reading readings_[2];
  unsigned next_ = 0;
};

}  // namespace polyhull::gl
