// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The picture in tiles, so that passes run over those only that something changes.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/program.h"

namespace polyhull {

inline constexpr int tile_side = 32;  ///< pixels of the picture

/// A tile's column and row.
struct Tile {
  std::uint16_t x, y;
};

/// How many tiles \p pixels in a row or a column begin.
constexpr int tiles_along(int pixels) {
  return (pixels + tile_side - 1) / tile_side;
}

/// \p part, grown to whole tiles of a picture of this size.
Rectangle whole_tiles(const Rectangle& part, int width, int height);

/// Those tiles of a picture that something touches.
class TileMask {
 public:
  /// None, of a picture of \p width x \p height pixels.
  TileMask(int width, int height);

  /// Adds the tiles of \p part (pixels) that triangles of \p subject can touch as \p
  /// clip_from_scene shows them, and what is up to \p beyond pixels from those: all of the part where
  /// the mesh reaches behind the eye.
  void add(const PlacedSubject& subject, const Mat4& clip_from_scene, const Rectangle& part,
           int beyond = 0);

  /// Adds all tiles that \p part (pixels) touches.
  void add(const Rectangle& part);

  bool has(int x, int y) const { return touched_[static_cast<std::size_t>(y) * columns_ + x] != 0; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }

 private:
  void fill(int x0, int y0, int x1, int y1);
  int width_, height_, columns_, rows_;
  std::vector<std::uint8_t> touched_;
};

/// Draws tiles with programs of shaders/tiles.vert.
class TileDrawing {
 public:
  /// Draws \p tiles into a target of \p width x \p height pixels, \p side of them a tile; the program
  /// is in use. With \p shaded, a texel a tile, only those that are \p wanted (not 0) there or, where
  /// it is given, in \p also; these are bound to \p unit and the next.
  void draw(gl::Program& program, std::span<const Tile> tiles, int width, int height, int side,
            int unit, GLuint shaded, bool wanted = true, GLuint also = 0);

 private:
  gl::VertexArray array_;
  gl::Buffer list_;
};

}  // namespace polyhull
