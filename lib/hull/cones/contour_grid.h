// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A uniform grid over one silhouette's edges: which edges may cross a small part of the picture,
/// and for the parts that none crosses, whether they lie inside.
///
/// It is a filter only. Edges are entered with a margin, far more than the rounding of the pixels
/// here against the exact rays, so an answer "no edge here" is certain. Cells are four times as
/// wide as it at least, so that an edge lies in few cells: where edges are short, the margin is
/// smaller. A ring of edges of about equal length lies in a few cells per edge, whatever its size
/// (cells are not below 0.001 px: rings smaller than that share a few cells).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/exact/pair.h"

namespace polyhull::hull {

/// Pixels by which edges and queries are enlarged, at most; where edges are shorter than twice this
/// it is less, but ten times what rays may be off their pixels at least.
inline constexpr double grid_margin = 0.01;

enum class CellState : std::uint8_t { outside, inside, unknown };

class ContourGrid {
 public:
  /// \p next[i] is the vertex after i along its ring; edge i runs from vertex i to next[i]. Rays
  /// may be off their pixels by \p pixel_error.
  void build(std::span<const Vec2> pixels, std::span<const std::uint32_t> next, double pixel_error);

  int columns() const { return columns_; }
  int rows() const { return rows_; }

  /// Cells that the interval covers, clamped to the grid; empty (first > last) if it misses the
  /// grid.
  void column_range(double from, double to, int& first, int& last) const {
    range(from, to, origin_.x, columns_, first, last);
  }
  void row_range(double from, double to, int& first, int& last) const {
    range(from, to, origin_.y, rows_, first, last);
  }
  /// A rectangle of cells; empty beside the grid.
  struct Block {
    int column0, column1, row0, row1;
    bool empty() const { return column0 > column1 || row0 > row1; }
  };
  /// Those that the box from \p low to \p high covers; its margin is the caller's.
  Block block(Pair low, Pair high) const {
    const Pair origin{origin_.x, origin_.y}, none{0.0, 0.0};
    const Pair count{static_cast<double>(columns_), static_cast<double>(rows_)};
    const Pair first = least(count, most(none, (low - origin) * inverse_));
    const Pair end = least(count, most(none, (high - origin) * inverse_ + 1.0));
    return {static_cast<int>(first[0]), static_cast<int>(end[0]) - 1, static_cast<int>(first[1]),
            static_cast<int>(end[1]) - 1};
  }
  /// Places and the margin in units of cells, from the grid's corner.
  Vec2 in_cells(const Vec2& p) const { return (p - origin_) * inverse_; }
  double margin() const { return margin_; }
  double margin_in_cells() const { return margin_ * inverse_; }
  double row_top(int row) const { return origin_.y + row * cell_; }
  Vec2 centre(int column, int row) const {
    return {origin_.x + (column + 0.5) * cell_, origin_.y + (row + 0.5) * cell_};
  }

  /// How many cells with edges the block of cells holds.
  std::uint32_t occupied(const Block& b) const {
    const std::size_t stride = columns_ + 1;
    const Cell *low = cells_.data() + b.row0 * stride,
               *high = cells_.data() + (b.row1 + 1) * stride;
    return high[b.column1 + 1].sum - low[b.column1 + 1].sum - high[b.column0].sum +
           low[b.column0].sum;
  }
  /// Whether the point lies in a cell without edges, or beside the grid.
  bool empty_at(const Vec2& p) const {
    const Block at = block(Pair{p.x, p.y}, Pair{p.x, p.y});
    return at.empty() || occupied(at) == 0;
  }

  std::span<const std::uint32_t> edges(int column, int row) const {
    return edges(column, column, row);
  }
  /// Those of the cells from \p column0 to \p column1; edges may occur several times.
  std::span<const std::uint32_t> edges(int column0, int column1, int row) const {
    const Cell* c = cells_.data() + static_cast<std::size_t>(row) * (columns_ + 1);
    return {items_.data() + c[column0].start, items_.data() + c[column1 + 1].start};
  }

  /// Whether the centre of the cell is inside by the even-odd rule; unknown where an edge is too
  /// near.
  CellState state(int column, int row) const {
    return states_[static_cast<std::size_t>(row) * columns_ + column];
  }

  struct Segment {
    Vec2 a, b;
  };
  const Segment& segment(std::uint32_t edge) const { return segments_[edge]; }

 private:
  void range(double from, double to, double origin, int count, int& first, int& last) const {
    const double a = (from - margin_ - origin) * inverse_, b = (to + margin_ - origin) * inverse_;
    first = a > 0 ? (a < count ? static_cast<int>(a) : count) : 0;
    last = b < count ? (b >= 0 ? static_cast<int>(b) : -1) : count - 1;
  }
  void choose_cells(double pixel_error);
  void enter_edges();
  void sum_occupied();
  void find_insides();
  template <class Visit>
  void visit_cells(const Vec2& p, const Vec2& q, Visit visit) const;

  Vec2 origin_{0.0};
  double cell_ = 1.0, inverse_ = 1.0, margin_ = grid_margin;
  int columns_ = 0, rows_ = 0;
  /// One more column and row than there are cells: a cell's edges end where the next one's start.
  struct Cell {
    std::uint32_t start;  ///< into items_
    std::uint32_t sum;    ///< occupied cells above and to the left
  };
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> items_;
  std::vector<Segment> segments_;
  std::vector<CellState> states_;
  std::vector<double> crossings_;
  std::vector<std::uint32_t> row_starts_;
};

}  // namespace polyhull::hull
