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

TileMask::TileMask(int width, int height, int side)
    : width_(width),
      height_(height),
      side_(side),
      columns_(tiles_along(width, side)),
      rows_(tiles_along(height, side)),
      touched_(static_cast<std::size_t>(columns_) * rows_, 0) {}

/// The tiles from pixel (x0, y0) to pixel (x1, y1).
void TileMask::fill(int x0, int y0, int x1, int y1) {
  for (int y = y0 / side_; y <= y1 / side_; ++y)
    for (int x = x0 / side_; x <= x1 / side_; ++x)
      touched_[static_cast<std::size_t>(y) * columns_ + x] = 1;
}

void TileMask::add(const Rectangle& part) {
  const Rectangle seen = intersection(part, {0, 0, width_, height_});
  if (!seen.empty()) fill(seen.x, seen.y, seen.x + seen.width - 1, seen.y + seen.height - 1);
}

void TileMask::add(const PlacedSubject& subject, const Mat4& clip_from_scene, const Rectangle& part,
                   int beyond) {
  if (part.empty()) return;
  constexpr float most = 1e5f;  // pixels; further away, single precision is too coarse
  const float margin = 0.25f + static_cast<float>(beyond);
  std::vector<Vec2f> at;
  at.reserve(subject.points.size());
  for (const Vec3f& point : subject.points) {
    const Vec4 clip = clip_from_scene * Vec4(Vec3(point), 1.0);
    if (!(clip.w > 1e-3)) return add(part);
    const Vec2f pixel(0.5 * (clip.x / clip.w + 1.0) * width_,
                      0.5 * (clip.y / clip.w + 1.0) * height_);
    if (!(std::abs(pixel.x) < most && std::abs(pixel.y) < most)) return add(part);
    at.push_back(pixel);
  }
  const std::vector<std::uint32_t>& triangles = subject.mesh->hull.triangles;
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
    add({at[triangles[i]], at[triangles[i + 1]], at[triangles[i + 2]]}, part, margin);
}

/// Adds the tiles of \p part that are up to \p margin pixels from a triangle (pixels), and few more.
void TileMask::add(const std::array<Vec2f, 3>& corners, const Rectangle& part, float margin) {
  const auto [a, b, c] = corners;
  const Vec2f low = glm::max(glm::min(a, glm::min(b, c)) - margin, Vec2f(part.x, part.y));
  const Vec2f end = Vec2f(part.x + part.width, part.y + part.height) - 0.01f;
  const Vec2f high = glm::min(glm::max(a, glm::max(b, c)) + margin, end);
  if (!(high.x >= low.x && high.y >= low.y)) return;
  const int first = static_cast<int>(low.y) / side_, last = static_cast<int>(high.y) / side_;
  for (int row = first; row <= last; ++row) {
    // What lies in the row of tiles ends at a corner or where an edge enters or leaves it.
    const float top = static_cast<float>(row * side_) - margin;
    const float bottom = static_cast<float>((row + 1) * side_) + margin;
    float left = high.x, right = low.x;
    for (int k = 0; k < 3; ++k) {
      const auto k0 = static_cast<std::size_t>(k), k1 = static_cast<std::size_t>((k + 1) % 3);
      const Vec2f &from = corners[k0], &to = corners[k1];
      if (std::max(from.y, to.y) < top || std::min(from.y, to.y) > bottom) continue;
      const Vec2f way = to - from;
      const float enter = way.y != 0.0f ? (top - from.y) / way.y : 0.0f;
      const float leave = way.y != 0.0f ? (bottom - from.y) / way.y : 1.0f;
      const float s = std::clamp(std::min(enter, leave), 0.0f, 1.0f);
      const float t = std::clamp(std::max(enter, leave), 0.0f, 1.0f);
      left = std::min(left, from.x + std::min(s * way.x, t * way.x) - margin);
      right = std::max(right, from.x + std::max(s * way.x, t * way.x) + margin);
    }
    left = std::max(left, low.x);
    right = std::min(right, high.x);
    if (left <= right)
      fill(static_cast<int>(left), row * side_, static_cast<int>(right), row * side_);
  }
}

void TileDrawing::draw(gl::Program& program, std::span<const Tile> tiles, int width, int height,
                       int side, int unit, const TileChoice& choice) {
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
  program.set("wanted", choice.shaded == 0 ? -1 : static_cast<int>(choice.wanted));
  program.set("enough", choice.enough);
  gl::bind_texture(unit, GL_TEXTURE_2D, choice.shaded);
  program.set("also", unit + 1);
  gl::bind_texture(unit + 1, GL_TEXTURE_2D, choice.also == 0 ? choice.shaded : choice.also);
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(tiles.size()));
}

}  // namespace polyhull
