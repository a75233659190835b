// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/cones/contour_grid.h"

#include <algorithm>
#include <cmath>

namespace polyhull::hull {

template <class Visit>
void ContourGrid::visit_cells(const Vec2& p, const Vec2& q, Visit visit) const {
  int row0, row1;
  row_range(std::min(p.y, q.y), std::max(p.y, q.y), row0, row1);
  const double dy = q.y - p.y, slope = dy != 0.0 ? (q.x - p.x) / dy : 0.0;
  const bool steep_enough = std::abs(dy) > 2 * margin_;
  for (int row = row0; row <= row1; ++row) {
    double xa = p.x, xb = q.x;
    if (steep_enough) {
      // The part of the segment in this row, enlarged by the margin.
      const double top = row_top(row) - margin_, bottom = row_top(row + 1) + margin_;
      const double ya = std::clamp(p.y, top, bottom), yb = std::clamp(q.y, top, bottom);
      xa = p.x + (ya - p.y) * slope;
      xb = p.x + (yb - p.y) * slope;
    }
    int column0, column1;
    column_range(std::min(xa, xb), std::max(xa, xb), column0, column1);
    for (int column = column0; column <= column1; ++column) visit(column, row);
  }
}

void ContourGrid::build(std::span<const Vec2> pixels, std::span<const std::uint32_t> next,
                        double pixel_error) {
  columns_ = rows_ = 0;
  if (pixels.empty()) return;
  segments_.resize(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) segments_[i] = {pixels[i], pixels[next[i]]};
  choose_cells(pixel_error);
  enter_edges();
  sum_occupied();
  find_insides();
}

/// Cells about twice as large as an edge is long, at most 24 per edge and 2^18 in all.
void ContourGrid::choose_cells(double pixel_error) {
  Vec2 low(1e300), high(-1e300);
  double length = 0.0;
  for (const Segment& s : segments_) {
    low = glm::min(low, s.a), high = glm::max(high, s.a);
    length += glm::length(s.b - s.a);
  }
  const Vec2 extent = high - low;
  const double n = static_cast<double>(segments_.size());
  const double limit = std::min(24.0 * n + 64.0, 262144.0);
  cell_ = std::max({2.0 * length / n, std::sqrt((extent.x + 1e-3) * (extent.y + 1e-3) / limit),
                    (extent.x + extent.y) / limit, 1e-3});
  margin_ = std::max(std::min(grid_margin, 0.25 * cell_), 10.0 * pixel_error);
  cell_ = std::max(cell_, 4.0 * margin_);
  inverse_ = 1.0 / cell_;
  // Off the lattice of round coordinates, so that cell centres seldom fall onto edges.
  origin_ = low - Vec2(0.3137, 0.2719) * cell_ - Vec2(2 * margin_);
  columns_ = static_cast<int>((high.x + 2 * margin_ - origin_.x) * inverse_) + 1;
  rows_ = static_cast<int>((high.y + 2 * margin_ - origin_.y) * inverse_) + 1;
}

/// Each edge into the cells that it comes near, and which cells' centres it hides.
void ContourGrid::enter_edges() {
  const std::size_t stride = static_cast<std::size_t>(columns_) + 1;
  // Counted into the cell after, so that after placing the edges each cell's start is right.
  cells_.assign(stride * (rows_ + 1) + 1, {0, 0});
  for (const Segment& s : segments_)
    visit_cells(s.a, s.b, [&](int c, int r) { ++cells_[r * stride + c + 1].start; });
  for (std::size_t c = 1; c < cells_.size(); ++c) cells_[c].start += cells_[c - 1].start;
  items_.resize(cells_.back().start);
  states_.assign(static_cast<std::size_t>(columns_) * rows_, CellState::outside);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Vec2 p = segments_[i].a, q = segments_[i].b, d = q - p;
    const double squared = std::max(glm::dot(d, d), 1e-300);
    visit_cells(p, q, [&](int c, int r) {
      const std::size_t cell = static_cast<std::size_t>(r) * columns_ + c;
      items_[cells_[r * stride + c].start++] = static_cast<std::uint32_t>(i);
      const Vec2 m = centre(c, r);
      const Vec2 away = p + std::clamp(glm::dot(m - p, d) / squared, 0.0, 1.0) * d - m;
      if (glm::dot(away, away) < 1e-8) states_[cell] = CellState::unknown;
    });
  }
  for (std::size_t c = cells_.size() - 1; c > 0; --c) cells_[c].start = cells_[c - 1].start;
  cells_[0].start = 0;
}

/// How many cells with edges lie above and to the left, for occupied().
void ContourGrid::sum_occupied() {
  const std::size_t stride = static_cast<std::size_t>(columns_) + 1;
  for (int r = 0; r < rows_; ++r) {
    std::uint32_t in_row = 0;
    for (int c = 0; c < columns_; ++c) {
      in_row += cells_[r * stride + c + 1].start > cells_[r * stride + c].start;
      cells_[(r + 1) * stride + c + 1].sum = cells_[r * stride + c + 1].sum + in_row;
    }
  }
}

/// Which cells' centres lie inside: from where the lines through the centres of each row of cells
/// cross the rings.
void ContourGrid::find_insides() {
  row_starts_.assign(rows_ + 1, 0);
  const auto visit_rows = [&](auto visit) {
    for (auto [p, q] : segments_) {
      if (p.y > q.y) std::swap(p, q);
      int r = static_cast<int>(std::max(0.0, std::floor((p.y - origin_.y) * inverse_ - 0.5)));
      for (; r < rows_; ++r) {
        const double y = centre(0, r).y;
        if (y < p.y) continue;
        if (y >= q.y) break;
        visit(r, p.x + (y - p.y) * (q.x - p.x) / (q.y - p.y));
      }
    }
  };
  visit_rows([&](int r, double) { ++row_starts_[r + 1]; });
  for (int r = 0; r < rows_; ++r) row_starts_[r + 1] += row_starts_[r];
  crossings_.resize(row_starts_[rows_]);
  visit_rows([&](int r, double x) { crossings_[row_starts_[r]++] = x; });
  for (int r = rows_; r > 0; --r) row_starts_[r] = row_starts_[r - 1];
  row_starts_[0] = 0;
  for (int r = 0; r < rows_; ++r) {
    std::uint32_t k = row_starts_[r];
    const std::uint32_t end = row_starts_[r + 1];
    std::sort(crossings_.begin() + k, crossings_.begin() + end);
    bool inside = false;
    for (int c = 0; c < columns_; ++c) {
      for (; k < end && crossings_[k] <= centre(c, r).x; ++k) inside = !inside;
      CellState& state = states_[static_cast<std::size_t>(r) * columns_ + c];
      if (state == CellState::outside && inside) state = CellState::inside;
    }
  }
}

}  // namespace polyhull::hull
