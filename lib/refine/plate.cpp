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

/// A walk over fewer nodes than this is over before a second thread is awake.
constexpr std::size_t nodes_for_threads = 32768;

template <typename Value>
void grow(std::vector<Value>& values, std::size_t size, Value fill) {
  if (values.size() < size) values.resize(size, fill);
}

}  // namespace

void PlateSolver::set_up(const Level& level, const PlateSettings& settings) {
  const Grid& grid = level.grid;
  grid_ = &grid;
  for (std::size_t k = 0; k < 8; ++k)
    corner_[k] = (k & 1) + (k & 2 ? grid.row() : 0) + (k & 4 ? grid.slab() : 0);
  for (auto* v : {&mask_, &solution_, &residual_, &laplacian_, &direction_, &more_})
    grow(*v, grid.size(), 0.0f);
  grow(cell_of_, grid.size(), -1);
  rows_.clear();
  nodes_ = 0;
  for (int z = border; z < grid.nz - border; ++z)
    for (int y = border; y < grid.ny - border; ++y) {
      const std::size_t start = grid.node(0, y, z);
      const float* hull = level.hull.data() + start;
      float* mask = mask_.data() + start;
      for (int x = 0; x < grid.nx; ++x) mask[x] = hull[x] > -settings.band ? 1.0f : 0.0f;
      std::fill_n(mask, border, 0.0f);
      std::fill_n(mask + grid.nx - border, border, 0.0f);
      int begin = 0, end = grid.nx;
      while (begin < end && mask[begin] == 0.0f) ++begin;
      while (begin < end && mask[end - 1] == 0.0f) --end;
      if (begin == end) continue;
      begin = begin / 8 * 8;
      const int count = (end - begin + 7) / 8 * 8;
      rows_.push_back({start + static_cast<std::size_t>(begin), count});
      nodes_ += static_cast<std::size_t>(count);
    }
}

void PlateSolver::gather(const Level& level, const ContactRays& rays, std::uint32_t part,
                         const PlateSettings& settings) {
  const Grid& grid = level.grid;
  cells_.clear();
  for (std::size_t i = 0; i < rays.rays.size(); i += settings.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part == part && ray.value >= far_outside) add_ray(ray, grid, settings);
  }
  for (const PlateCell& cell : cells_) cell_of_[cell.node] = -1;
}

void PlateSolver::add_ray(const ContactRay& ray, const Grid& grid, const PlateSettings& settings) {
  const Vec3f at = (ray.rim() - grid.low) / grid.cell;
  const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
  if (x < border || y < border || z < border || x >= grid.nx - border - 1 ||
      y >= grid.ny - border - 1 || z >= grid.nz - border - 1)
    return;
  const std::size_t node = grid.node(x, y, z);
  if (cell_of_[node] < 0) {
    cell_of_[node] = static_cast<std::int32_t>(cells_.size());
    cells_.push_back({.node = static_cast<std::uint32_t>(node)});
  }
  PlateCell& cell = cells_[static_cast<std::size_t>(cell_of_[node])];
  const auto each = static_cast<float>(settings.stride);
  const float by_value = each * settings.value, by_normal = each * settings.normal;
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

void PlateSolver::start(const Level& level, float tie) {
  for (const Row& row : rows_)
    for (std::size_t i = row.node; i < row.node + static_cast<std::size_t>(row.count); ++i) {
      const float hull = level.hull[i], f = level.values[i];
      residual_[i] = mask_[i] * tie * (hull < 0.0f ? std::min(f, hull) : f);
      solution_[i] = 0.0f;
    }
  for (const PlateCell& cell : cells_)
    for (std::size_t k = 0; k < 8; ++k)
      residual_[cell.node + corner_[k]] += mask_[cell.node + corner_[k]] * cell.wanted[k];
}

template <typename Body>
double PlateSolver::sum_rows(int threads, const Body& body) {
  const auto row_length = static_cast<std::ptrdiff_t>(grid_->row());
  const auto slab = static_cast<std::ptrdiff_t>(grid_->slab());
  sums_.assign((rows_.size() + rows_per_piece - 1) / rows_per_piece, 0.0);
  const auto do_pieces = [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      float lanes[8] = {};
      const std::size_t last = std::min(rows_.size(), (p + 1) * rows_per_piece);
      for (std::size_t r = p * rows_per_piece; r < last; ++r)
        body(rows_[r].node, PlateRow{rows_[r].count, row_length, slab, &mask_[rows_[r].node]},
             lanes);
      for (const float lane : lanes) sums_[p] += static_cast<double>(lane);
    }
  };
  parallel_for(sums_.size(), 1, nodes_ < nodes_for_threads ? 1 : threads, do_pieces);
  double sum = 0.0;
  for (const double some : sums_) sum += some;
  return sum;
}

double PlateSolver::bend(const float* f, float tie, int threads) {
  const Loops& use = loops();
  const double bent = sum_rows(threads, [&](std::size_t node, const PlateRow& row, float* sums) {
    use.laplacian(row, f + node, tie, laplacian_.data() + node, sums);
  });
  float lanes[8] = {};
  use.cells(cells_.data(), cells_.size(), corner_.data(), mask_.data(), f, more_.data(), lanes);
  double asked = 0.0;
  for (const float lane : lanes) asked += static_cast<double>(lane);
  return bent + asked;
}

double PlateSolver::step(const float* f, float tie, float length, int threads) {
  const Loops& use = loops();
  return sum_rows(threads, [&](std::size_t node, const PlateRow& row, float* sums) {
    use.step(row, f + node, laplacian_.data() + node, tie, length, more_.data() + node,
             solution_.data() + node, residual_.data() + node, sums);
  });
}

void PlateSolver::solve(Level& level, const ContactRays& rays, std::uint32_t part,
                        const PlateSettings& settings, int threads) {
  const float tie = settings.tie;
  set_up(level, settings);
  gather(level, rays, part, settings);
  start(level, tie);
  // From 0 to f as it is, whatever the energy; then by conjugate gradients.
  bend(level.values.data(), tie, threads);
  double error = step(level.values.data(), tie, 1.0f, threads);
  float keep = 0.0f;
  for (int i = 0; i < settings.steps && error > 1e-11; ++i) {
    sum_rows(threads, [&](std::size_t node, const PlateRow& row, float*) {
      loops().turn(row.count, residual_.data() + node, keep, direction_.data() + node);
    });
    const double curvature = bend(direction_.data(), tie, threads);
    if (!(curvature > 0.0)) break;
    const double left =
        step(direction_.data(), tie, static_cast<float>(error / curvature), threads);
    keep = static_cast<float>(left / error);
    error = left;
  }
  for (const Row& row : rows_) {
    const auto count = static_cast<std::size_t>(row.count);
    for (std::size_t i = row.node; i < row.node + count; ++i)
      level.values[i] = std::clamp(solution_[i], -3.3f, 10.0f);
    for (auto* v : {&laplacian_, &direction_, &more_})
      std::fill_n(v->data() + row.node, count, 0.0f);
  }
}

}  // namespace polyhull::refine
