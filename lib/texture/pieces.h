// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A mesh's triangles as pieces on a view's grid, and which of them cover a part of it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "texture/texture_loops.h"

namespace polyhull {

/// Cuts triangles into pieces of a twentieth of the grid at most, or of 16 texels. Pieces outside the
/// grid and behind the camera are left out, and so is a last shred of what reaches behind it.
class PieceCutter {
 public:
  /// The largest width and height of a piece, texels.
  static float largest(int width, int height) {
    return static_cast<float>(std::max(16, std::max(width, height) / 20));
  }

  /// \p grid_from_local: to (x z, y z, z), texels.
  PieceCutter(const glm::dmat4x3& grid_from_local, int width, int height,
              std::vector<Piece>& pieces)
      : grid_from_local_(grid_from_local),
        right_(static_cast<float>(width - 1)),
        bottom_(static_cast<float>(height - 1)),
        largest_(largest(width, height)),
        pieces_(pieces) {}

  /// The triangle's corners, local.
  void cut(std::uint32_t triangle, const Vec3f& a, const Vec3f& b, const Vec3f& c);

 private:
  void cut(std::uint32_t triangle, const Vec3& a, const Vec3& b, const Vec3& c, int depth);

  glm::dmat4x3 grid_from_local_;
  float right_, bottom_, largest_;
  std::vector<Piece>& pieces_;
};

/// Which pieces cover which cell of the grid; of cells that somebody asks for.
class PieceCells {
 public:
  static constexpr int side = 8;  ///< texels

  void begin(int width, int height);
  /// Asks for what may hide a piece.
  void want(const PieceShape& shape);
  /// Sorts the pieces into the cells that are wanted, those nearer than what is asked about there.
  void fill(std::span<const PieceShape> shapes);

  /// Calls visit(i) once for each piece i of the wanted cells that may(i) allows, cell by cell: what
  /// is asked about one after the other lies in the same places.
  template <class May, class Visit>
  void each_piece(std::span<const PieceShape> shapes, May&& may, Visit&& visit) const {
    for (std::size_t number = 0, at = 0; number < wanted_.size(); ++number)
      for (; at < ends_[number]; ++at)
        if (may(piece_[at]) && first_wanted(shapes[piece_[at]]) == number) visit(piece_[at]);
  }

  /// Calls visit(occluders) for each cell that the piece covers.
  template <class Visit>
  void around(const PieceShape& shape, Visit&& visit) const {
    const Span s = span_of(shape);
    for (int y = s.top; y <= s.bottom; ++y)
      for (int x = s.left; x <= s.right; ++x) visit(cell(y * across_ + x));
  }

 private:
  struct Span {
    int left, right, top, bottom;
  };
  static int cell_at(float v, int count) {
    const auto most = static_cast<float>(count * side - 1);
    return v > 0.0f ? static_cast<int>(v < most ? v : most) / side : 0;
  }
  Span span_of(const PieceShape& s) const {
    return {cell_at(s.left, across_), cell_at(s.right, across_), cell_at(s.top, down_),
            cell_at(s.bottom, down_)};
  }
  template <class Visit>
  void each_wanted(const PieceShape& shape, Visit&& visit) const {
    const Span s = span_of(shape);
    for (int y = s.top; y <= s.bottom; ++y)
      for (int x = s.left; x <= s.right; ++x) {
        const std::size_t cell = static_cast<std::size_t>(y) * across_ + x;
        if (shape.nearest > wanted_[cell]) visit(cell);
      }
  }
  std::size_t first_wanted(const PieceShape& shape) const {
    std::size_t first = wanted_.size();
    each_wanted(shape, [&](std::size_t cell) { first = cell < first ? cell : first; });
    return first;
  }
  Occluders cell(int number) const;

  int across_ = 0, down_ = 0;
  std::vector<float> wanted_;  // the smallest 1 / depth that is asked about
  std::vector<std::uint32_t> ends_;
  std::vector<std::uint32_t> cells_, numbers_;  // of each entry, as they were found
  std::vector<float> left_, right_, top_, bottom_, nearest_;
  std::vector<std::uint32_t> piece_;
};

}  // namespace polyhull
