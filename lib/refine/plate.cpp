// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/plate.h"

#include <algorithm>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// Nodes at the border whose Laplacian of the Laplacian would reach out of the grid.
constexpr int border = 2;
/// Rims that lie further outside the surface pull, but say nothing of the normal.
constexpr float far_outside = -1.0f;
/// Rows handled as one piece of work.
constexpr std::size_t rows_per_piece = 128;

/// A sum in eight lanes: always the same additions, which the compiler vectorises.
class Lanes {
 public:
  void add_product(const float* a, const float* b, int count) {
    int i = 0;
    for (; i + 8 <= count; i += 8)
      for (int k = 0; k < 8; ++k) lane_[k] += a[i + k] * b[i + k];
    for (; i < count; ++i) lane_[0] += a[i] * b[i];
  }
  double sum() const {
    double sum = 0.0;
    for (const float lane : lane_) sum += static_cast<double>(lane);
    return sum;
  }

 private:
  float lane_[8] = {};
};

/// sum(i) of all rows in their order, each piece's on some thread.
template <typename RowSum>
double sum_rows(std::size_t rows, int threads, const RowSum& of_row) {
  const std::size_t pieces = (rows + rows_per_piece - 1) / rows_per_piece;
  std::vector<double> sums(pieces, 0.0);
  parallel_for(pieces, 1, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      double sum = 0.0;
      for (std::size_t r = p * rows_per_piece; r < std::min(rows, (p + 1) * rows_per_piece); ++r)
        sum += of_row(r);
      sums[p] = sum;
    }
  });
  double sum = 0.0;
  for (const double some : sums) sum += some;
  return sum;
}

/// out = mask * (Laplacian of f [+ tie * own]).
template <bool with_tie>
void laplacian(const float* __restrict f, const float* __restrict mask, const float* __restrict tie,
               const float* __restrict own, float* __restrict out, std::ptrdiff_t row,
               std::ptrdiff_t slab, int count) {
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    float sum =
        f[i - 1] + f[i + 1] + f[i - row] + f[i + row] + f[i - slab] + f[i + slab] - 6.0f * f[i];
    if (with_tie) sum += tie[i] * own[i];
    out[i] = mask[i] * sum;
  }
}

}  // namespace

void PlateSolver::set_up(const Level& level, const PlateSettings& settings) {
  const Grid& grid = level.grid;
  grid_ = &grid;
  for (std::size_t k = 0; k < 8; ++k)
    corner_[k] = (k & 1) + (k & 2 ? grid.row() : 0) + (k & 4 ? grid.slab() : 0);
  mask_.assign(grid.size(), 0.0f);
  tie_.assign(grid.size(), 0.0f);
  rows_.clear();
  for (int z = border; z < grid.nz - border; ++z)
    for (int y = border; y < grid.ny - border; ++y) {
      Row row{grid.node(0, y, z), -1, -1};
      for (int x = border; x < grid.nx - border; ++x) {
        const std::size_t node = row.start + static_cast<std::size_t>(x);
        if (level.hull[node] <= -settings.band) continue;
        mask_[node] = 1.0f;
        tie_[node] = level.hull[node] < 0.0f ? std::max(settings.tie, 0.01f) : settings.tie;
        if (row.begin < 0) row.begin = x;
        row.end = x + 1;
      }
      if (row.begin >= 0) rows_.push_back(row);
    }
  for (auto* v : {&laplacian_, &solution_, &residual_, &direction_, &image_})
    v->assign(grid.size(), 0.0f);
}

void PlateSolver::gather(const Level& level, const ContactRays& rays, std::uint32_t part,
                         const PlateSettings& settings) {
  const Grid& grid = level.grid;
  cell_of_.assign(grid.size(), -1);
  cells_.clear();
  const auto each = static_cast<float>(settings.stride);
  const float by_value = each * settings.value;
  const float by_normal = each * settings.normal;
  for (std::size_t i = 0; i < rays.rays.size(); i += settings.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value < far_outside) continue;
    const Vec3f at = (ray.rim() - grid.low) / grid.cell;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    if (x < border || y < border || z < border || x >= grid.nx - border - 1 ||
        y >= grid.ny - border - 1 || z >= grid.nz - border - 1)
      continue;
    const std::size_t node = grid.node(x, y, z);
    if (cell_of_[node] < 0) {
      cell_of_[node] = static_cast<std::int32_t>(cells_.size());
      cells_.push_back({.node = static_cast<std::uint32_t>(node)});
    }
    Cell& cell = cells_[static_cast<std::size_t>(cell_of_[node])];
    const float a = at.x - static_cast<float>(x), b = at.y - static_cast<float>(y),
                c = at.z - static_cast<float>(z);
    float value[8], dx[8], dy[8], dz[8];
    for (int k = 0; k < 8; ++k) {
      const float p = k & 1 ? a : 1 - a, q = k & 2 ? b : 1 - b, r = k & 4 ? c : 1 - c;
      value[k] = p * q * r;
      dx[k] = (k & 1 ? 1.0f : -1.0f) * q * r;
      dy[k] = p * (k & 2 ? 1.0f : -1.0f) * r;
      dz[k] = p * q * (k & 4 ? 1.0f : -1.0f);
    }
    for (int p = 0; p < 8; ++p) {
      for (int q = 0; q < 8; ++q)
        cell.form[8 * p + q] += by_value * value[p] * value[q] +
                                by_normal * (dx[p] * dx[q] + dy[p] * dy[q] + dz[p] * dz[q]);
      cell.wanted[p] -= by_normal * grid.cell *
                        (dx[p] * ray.normal.x + dy[p] * ray.normal.y + dz[p] * ray.normal.z);
    }
  }
}

void PlateSolver::apply_cells(const float* f, float* out) const {
  for (const Cell& cell : cells_) {
    float in[8], sum[8] = {};
    for (int k = 0; k < 8; ++k) in[k] = f[cell.node + corner_[k]];
    for (int p = 0; p < 8; ++p)
      for (int q = 0; q < 8; ++q) sum[q] += cell.form[8 * p + q] * in[p];
    for (int k = 0; k < 8; ++k) {
      const std::size_t node = cell.node + corner_[k];
      out[node] += mask_[node] * sum[k];
    }
  }
}

/// The gradient of the energy's quadratic part at f, on the band.
void PlateSolver::apply(const float* f, float* out, int threads) {
  const auto row = static_cast<std::ptrdiff_t>(grid_->row()),
             slab = static_cast<std::ptrdiff_t>(grid_->slab());
  const auto each_row = [&](const auto& body) {
    parallel_for(rows_.size(), rows_per_piece, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r)
        body(rows_[r].start + static_cast<std::size_t>(rows_[r].begin),
             rows_[r].end - rows_[r].begin);
    });
  };
  each_row([&](std::size_t at, int count) {
    laplacian<false>(f + at, mask_.data() + at, nullptr, nullptr, laplacian_.data() + at, row, slab,
                     count);
  });
  each_row([&](std::size_t at, int count) {
    laplacian<true>(laplacian_.data() + at, mask_.data() + at, tie_.data() + at, f + at, out + at,
                    row, slab, count);
  });
  apply_cells(f, out);
}

void PlateSolver::solve(Level& level, const ContactRays& rays, std::uint32_t part,
                        const PlateSettings& settings, int threads) {
  set_up(level, settings);
  gather(level, rays, part, settings);
  const auto first = [&](std::size_t r) {
    return rows_[r].start + static_cast<std::size_t>(rows_[r].begin);
  };
  const auto count = [&](std::size_t r) { return rows_[r].end - rows_[r].begin; };

  apply(level.values.data(), image_.data(), threads);
  for (const Row& row : rows_)
    for (int x = row.begin; x < row.end; ++x) {
      const std::size_t i = row.start + static_cast<std::size_t>(x);
      const float hull = level.hull[i], f = level.values[i];
      if (mask_[i] != 0.0f)
        residual_[i] = tie_[i] * (hull < 0.0f ? std::min(f, hull) : f) - image_[i];
    }
  for (const Cell& cell : cells_)
    for (std::size_t k = 0; k < 8; ++k)
      residual_[cell.node + corner_[k]] += mask_[cell.node + corner_[k]] * cell.wanted[k];
  direction_ = residual_;
  const auto square = [&](std::size_t r) {
    Lanes lanes;
    lanes.add_product(residual_.data() + first(r), residual_.data() + first(r), count(r));
    return lanes.sum();
  };
  double error = sum_rows(rows_.size(), threads, square);
  for (int step = 0; step < settings.steps && error > 1e-11; ++step) {
    apply(direction_.data(), image_.data(), threads);
    const double curvature = sum_rows(rows_.size(), threads, [&](std::size_t r) {
      Lanes lanes;
      lanes.add_product(direction_.data() + first(r), image_.data() + first(r), count(r));
      return lanes.sum();
    });
    if (!(curvature > 0.0)) break;
    const auto length = static_cast<float>(error / curvature);
    const double left = sum_rows(rows_.size(), threads, [&](std::size_t r) {
      const std::size_t at = first(r);
      for (std::size_t i = at; i < at + static_cast<std::size_t>(count(r)); ++i) {
        solution_[i] += length * direction_[i];
        residual_[i] -= length * image_[i];
      }
      return square(r);
    });
    const auto keep = static_cast<float>(left / error);
    error = left;
    for (std::size_t r = 0; r < rows_.size(); ++r)
      for (std::size_t i = first(r); i < first(r) + static_cast<std::size_t>(count(r)); ++i)
        direction_[i] = residual_[i] + keep * direction_[i];
  }
  for (std::size_t r = 0; r < rows_.size(); ++r)
    for (std::size_t i = first(r); i < first(r) + static_cast<std::size_t>(count(r)); ++i)
      level.values[i] = std::clamp(level.values[i] + solution_[i], -3.3f, 10.0f);
}

}  // namespace polyhull::refine
