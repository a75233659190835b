// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/tiles.h"

#include <algorithm>
#include <cmath>

#include "render/gl/passes.h"

namespace polyhull {

Rectangle whole_tiles(const Rectangle& part, int width, int height) {
  if (part.empty()) return {};
  const int x0 = part.x / tile_side * tile_side, y0 = part.y / tile_side * tile_side;
  const int x1 = tiles_along(part.x + part.width) * tile_side;
  const int y1 = tiles_along(part.y + part.height) * tile_side;
  return intersection({x0, y0, x1 - x0, y1 - y0}, {0, 0, width, height});
}

TileMask::TileMask(int width, int height)
    : width_(width),
      height_(height),
      columns_(tiles_along(width)),
      rows_(tiles_along(height)),
      touched_(static_cast<std::size_t>(columns_) * rows_, 0) {}

/// The tiles from pixel (x0, y0) to pixel (x1, y1).
void TileMask::fill(int x0, int y0, int x1, int y1) {
  for (int y = y0 / tile_side; y <= y1 / tile_side; ++y)
    for (int x = x0 / tile_side; x <= x1 / tile_side; ++x)
      touched_[static_cast<std::size_t>(y) * columns_ + x] = 1;
}

void TileMask::add(const Rectangle& part) {
  const Rectangle seen = intersection(part, {0, 0, width_, height_});
  if (!seen.empty()) fill(seen.x, seen.y, seen.x + seen.width - 1, seen.y + seen.height - 1);
}

void TileMask::add(const PlacedSubject& subject, const Mat4& clip_from_scene, const Rectangle& part,
                   int beyond) {
  if (part.empty()) return;
  const auto margin = static_cast<float>(1 + beyond);
  std::vector<Vec2f> at;
  at.reserve(subject.points.size());
  for (const Vec3f& point : subject.points) {
    const Vec4 clip = clip_from_scene * Vec4(Vec3(point), 1.0);
    if (!(clip.w > 1e-3)) return add(part);
    at.emplace_back(0.5 * (clip.x / clip.w + 1.0) * width_,
                    0.5 * (clip.y / clip.w + 1.0) * height_);
  }
  const Vec2f first(part.x, part.y), last(part.x + part.width - 1, part.y + part.height - 1);
  const std::vector<std::uint32_t>& triangles = subject.mesh->hull.triangles;
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const Vec2f &a = at[triangles[i]], &b = at[triangles[i + 1]], &c = at[triangles[i + 2]];
    // A pixel around, for samples beside the pixels' middles and for rounding.
    const Vec2f low = glm::min(a, glm::min(b, c)) - margin;
    const Vec2f high = glm::max(a, glm::max(b, c)) + margin;
    if (!(high.x >= first.x && high.y >= first.y && low.x <= last.x && low.y <= last.y)) continue;
    const Vec2f from = glm::max(low, first), to = glm::min(high, last);
    fill(static_cast<int>(from.x), static_cast<int>(from.y), static_cast<int>(to.x),
         static_cast<int>(to.y));
  }
}

void TileDrawing::draw(gl::Program& program, std::span<const Tile> tiles, int width, int height,
                       int side, int unit, GLuint shaded, bool wanted, GLuint also) {
  if (tiles.empty()) return;
  glBindVertexArray(array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, list_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(tiles.size_bytes()), tiles.data(),
               GL_STREAM_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribIPointer(0, 2, GL_UNSIGNED_SHORT, sizeof(Tile), nullptr);
  glVertexAttribDivisor(0, 1);
  program.set("size", glm::vec2(width, height));
  program.set("side", static_cast<float>(side));
  program.set("shaded", unit);
  program.set("wanted", shaded == 0 ? -1 : static_cast<int>(wanted));
  gl::bind_texture(unit, GL_TEXTURE_2D, shaded);
  program.set("also", unit + 1);
  gl::bind_texture(unit + 1, GL_TEXTURE_2D, also == 0 ? shaded : also);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(tiles.size()));
}

}  // namespace polyhull
