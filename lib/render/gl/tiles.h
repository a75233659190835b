// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The picture in tiles, so that passes run over those only that something changes.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/program.h"

namespace polyhull {

inline constexpr int tile_side = 32;       ///< pixels of the picture
inline constexpr int small_tile_side = 8;  ///< of those that are put together

/// A tile's column and row.
struct Tile {
  std::uint16_t x, y;
};

/// How many tiles \p pixels in a row or a column begin.
constexpr int tiles_along(int pixels, int side = tile_side) {
  return (pixels + side - 1) / side;
}

/// \p part, grown to whole tiles of a picture of this size.
Rectangle whole_tiles(const Rectangle& part, int width, int height);

/// Those tiles of a picture that something touches.
class TileMask {
 public:
  /// None, of a picture of \p width x \p height pixels in tiles of \p side pixels.
  TileMask(int width, int height, int side);

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
  void add(const std::array<Vec2f, 3>& corners, const Rectangle& part, float margin);
  void fill(int x0, int y0, int x1, int y1);
  int width_, height_, side_, columns_, rows_;
  std::vector<std::uint8_t> touched_;
};

/// Tiles by what only the graphics processor knows of them.
struct TileChoice {
  GLuint shaded = 0;   ///< a texel a tile; 0: all tiles
  bool wanted = true;  ///< those that have more than `enough` there or in `also`, or the others
  GLuint also = 0;     ///< 0: nothing more
  float enough = 0.1f;
};

/// Draws tiles with programs of shaders/tiles.vert.
class TileDrawing {
 public:
  /// Draws \p tiles into a target of \p width x \p height pixels, \p side of them a tile; the program
  /// is in use. With \p choice, only those that it names, whose textures are bound to \p unit and the
  /// next.
  void draw(gl::Program& program, std::span<const Tile> tiles, int width, int height, int side,
            int unit, const TileChoice& choice);

 private:
  gl::VertexArray array_;
  gl::Buffer list_;
};

}  // namespace polyhull
