// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/background_texture.h"

#include <algorithm>
#include <cstring>

#include "render/gl/objects/pixel_readings.h"
#include "render/gl/tiles.h"

namespace polyhull {

void BackgroundTexture::resize(int width, int height) {
  if (width_ == width && height_ == height) return;
  width_ = width;
  height_ = height;
  copy_.resize(4 * static_cast<std::size_t>(width) * height);
  shows_.assign(static_cast<std::size_t>(tiles_along(width)) * tiles_along(height), std::nullopt);
  gl::bind_texture(0, GL_TEXTURE_2D, texture_.get());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  gl::texture_parameters(GL_TEXTURE_2D, GL_LINEAR);
}

/// Whether the picture is another than the texture in \p tile (pixels).
bool BackgroundTexture::differs(const Rectangle& tile, const std::uint8_t* pixels,
                                int stride) const {
  const std::size_t bytes = 4 * static_cast<std::size_t>(tile.width);
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    const std::uint8_t* own = &copy_[4 * (static_cast<std::size_t>(y) * width_ + tile.x)];
    if (std::memcmp(own, pixels + static_cast<std::ptrdiff_t>(y) * stride + 4 * tile.x, bytes) != 0)
      return true;
  }
  return false;
}

std::uint64_t BackgroundTexture::upload(const Rectangle& part, const std::uint8_t* pixels,
                                        int stride) {
  const std::uint8_t* first = pixels + static_cast<std::ptrdiff_t>(part.y) * stride + 4 * part.x;
  const std::size_t bytes = 4 * static_cast<std::size_t>(part.width);
  for (int y = 0; y < part.height; ++y)
    std::memcpy(&copy_[4 * (static_cast<std::size_t>(part.y + y) * width_ + part.x)],
                first + static_cast<std::ptrdiff_t>(y) * stride, bytes);
  glTexSubImage2D(GL_TEXTURE_2D, 0, part.x, part.y, part.width, part.height, GL_RGBA,
                  GL_UNSIGNED_BYTE, first);
  return bytes * static_cast<std::size_t>(part.height);
}

std::uint64_t BackgroundTexture::pixels_changed(const Rectangle& part, const std::uint8_t* pixels,
                                                int stride) const {
  std::uint64_t count = 0;
  for (int y = part.y; y < part.y + part.height; ++y)
    count += gl::pixels_that_differ(&copy_[4 * (static_cast<std::size_t>(y) * width_ + part.x)],
                                    pixels + static_cast<std::ptrdiff_t>(y) * stride + 4 * part.x,
                                    static_cast<std::size_t>(part.width));
  return count;
}

std::uint64_t BackgroundTexture::update(const RenderFrame& frame, const Rectangle& part,
                                        const std::uint8_t* pixels, int stride, bool skip) {
  resize(frame.width, frame.height);
  gl::bind_texture(0, GL_TEXTURE_2D, texture_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, stride / 4);
  const Rectangle all = whole_tiles(part, width_, height_);
  const std::uint64_t content = frame.background_content;
  std::uint64_t bytes = 0;
  // Of each row of tiles, from the first to the last that is another: calls cost, too.
  for (int y = all.y; y < all.y + all.height; y += tile_side) {
    Rectangle other;
    for (int x = all.x; x < all.x + all.width; x += tile_side) {
      const Rectangle tile = intersection({x, y, tile_side, tile_side}, {0, 0, width_, height_});
      std::optional<std::uint64_t>& shows =
          shows_[static_cast<std::size_t>(y / tile_side) * tiles_along(width_) + x / tile_side];
      const bool same =
          skip && shows && ((content != 0 && *shows == content) || !differs(tile, pixels, stride));
      shows = content;
      if (!same) other = bounding(other, tile);
    }
    if (!other.empty()) bytes += upload(other, pixels, stride);
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  return bytes;
}

}  // namespace polyhull
