// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The background's picture as a texture, to which only what has changed of it is uploaded.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "render/frame.h"
#include "render/gl/objects/gl_objects.h"

namespace polyhull {

class BackgroundTexture {
 public:
  /// Has the tiles of \p part (pixels) show the picture \p pixels of the frame's size, RGBA rows
  /// \p stride bytes apart (a multiple of 4), which may be written to afterwards. Returns how many
  /// bytes were uploaded; without \p skip those of all these tiles.
  std::uint64_t update(const RenderFrame& frame, const Rectangle& part, const std::uint8_t* pixels,
                       int stride, bool skip);

  /// How many pixels of \p part, which was asked for, are others in the picture \p pixels.
  std::uint64_t pixels_changed(const Rectangle& part, const std::uint8_t* pixels, int stride) const;

  /// RGBA8, sampled linearly. Tiles that were never asked for hold anything.
  GLuint get() { return texture_.get(); }

 private:
  void resize(int width, int height);
  bool differs(const Rectangle& tile, const std::uint8_t* pixels, int stride) const;
  std::uint64_t upload(const Rectangle& part, const std::uint8_t* pixels, int stride);

  gl::Texture texture_;
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> copy_;  // of the texture, rows of 4 * width_ bytes
  /// Of each tile, the RenderFrame::background_content that it is known to show, 0 where that had no
  /// number; none: nothing was uploaded.
  std::vector<std::optional<std::uint64_t>> shows_;
};

}  // namespace polyhull
