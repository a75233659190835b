// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyhull {
namespace {

constexpr int most_halvings = 12;

double squared_length(const Vec3& v) {
  return glm::dot(v, v);
}

}  // namespace

void PieceCutter::cut(std::uint32_t triangle, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const auto on_grid = [&](const Vec3f& p) { return grid_from_local_ * Vec4(Vec3(p), 1.0); };
  cut(triangle, on_grid(a), on_grid(b), on_grid(c), 0);
}

void PieceCutter::cut(std::uint32_t triangle, const Vec3& a, const Vec3& b, const Vec3& c,
                      int depth) {
  if (!(a.z > 0.0) && !(b.z > 0.0) && !(c.z > 0.0)) return;
  const bool before = a.z > 0.0 && b.z > 0.0 && c.z > 0.0;
  const Vec3* corner[3] = {&a, &b, &c};
  // Which edge is the longest, from corner i to the next one: on the grid, or where the piece
  // reaches behind the camera, in space.
  double length[3];
  if (before) {
    Piece piece;
    for (int i = 0; i < 3; ++i) {
      piece.inverse[i] = static_cast<float>(1.0 / corner[i]->z);
      piece.x[i] = static_cast<float>(corner[i]->x / corner[i]->z);
      piece.y[i] = static_cast<float>(corner[i]->y / corner[i]->z);
    }
    const auto [left, right] = std::minmax({piece.x[0], piece.x[1], piece.x[2]});
    const auto [top, bottom] = std::minmax({piece.y[0], piece.y[1], piece.y[2]});
    if (!(left <= right_ && right >= 0.0f && top <= bottom_ && bottom >= 0.0f)) return;
    if ((right - left <= largest_ && bottom - top <= largest_) || depth == most_halvings) {
      piece.triangle = triangle;
      piece.part = std::ldexp(1.0f, -depth);
      pieces_.push_back(piece);
      return;
    }
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      length[i] = std::hypot(piece.x[j] - piece.x[i], piece.y[j] - piece.y[i]);
    }
  } else {
    if (depth == most_halvings) return;
    for (int i = 0; i < 3; ++i) length[i] = squared_length(*corner[(i + 1) % 3] - *corner[i]);
  }
  const auto i = static_cast<int>(std::max_element(length, length + 3) - length);
  const Vec3 &from = *corner[i], &to = *corner[(i + 1) % 3], &other = *corner[(i + 2) % 3];
  const Vec3 middle = 0.5 * (from + to);
  cut(triangle, from, middle, other, depth + 1);
  cut(triangle, middle, to, other, depth + 1);
}

void PieceCells::begin(int width, int height) {
  across_ = (width + side - 1) / side;
  down_ = (height + side - 1) / side;
  wanted_.assign(static_cast<std::size_t>(across_) * down_, std::numeric_limits<float>::max());
}

void PieceCells::want(const PieceShape& shape) {
  const Span s = span_of(shape);
  for (int y = s.top; y <= s.bottom; ++y)
    for (int x = s.left; x <= s.right; ++x) {
      float& wanted = wanted_[static_cast<std::size_t>(y) * across_ + x];
      wanted = std::min(wanted, std::nextafter(shape.farthest, 0.0f));
    }
}

void PieceCells::fill(std::span<const PieceShape> shapes) {
  ends_.assign(wanted_.size() + 1, 0);
  cells_.clear();
  numbers_.clear();
  for (std::uint32_t i = 0; i < shapes.size(); ++i)
    each_wanted(shapes[i], [&](std::size_t cell) {
      ++ends_[cell + 1];
      cells_.push_back(static_cast<std::uint32_t>(cell));
      numbers_.push_back(i);
    });
  for (std::size_t cell = 1; cell < ends_.size(); ++cell) ends_[cell] += ends_[cell - 1];
  const std::size_t size = ends_.back() + DepthGrid::padding;
  for (auto* numbers : {&left_, &right_, &top_, &bottom_, &nearest_}) numbers->resize(size);
  piece_.resize(size);
  for (std::size_t j = 0; j < cells_.size(); ++j) {
    const PieceShape& s = shapes[numbers_[j]];
    const std::uint32_t at = ends_[cells_[j]]++;
    left_[at] = s.left;
    right_[at] = s.right;
    top_[at] = s.top;
    bottom_[at] = s.bottom;
    nearest_[at] = s.nearest;
    piece_[at] = numbers_[j];
  }
}

Occluders PieceCells::cell(int number) const {
  const std::uint32_t begin = number == 0 ? 0 : ends_[static_cast<std::size_t>(number) - 1];
  const auto end = ends_[static_cast<std::size_t>(number)];
  return {static_cast<int>(end - begin),
          &left_[begin],
          &right_[begin],
          &top_[begin],
          &bottom_[begin],
          &nearest_[begin],
          &piece_[begin]};
}

}  // namespace polyhull
