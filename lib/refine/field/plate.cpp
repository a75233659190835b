// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/plate.h"

#include <algorithm>
#include <numeric>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// Nodes at the border whose Laplacian of the Laplacian would reach out of the grid.
constexpr int border = 2;
/// Rims that lie further outside the surface pull, but say nothing of the normal.
constexpr float lost_rim = -1.0f;
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
  for (auto* v : {&mask_, &solution_, &residual_, &laplacian_, &direction_, &more_})
    grow(*v, grid.size(), 0.0f);
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
      add_row(start, mask, grid.nx);
    }
}

void PlateSolver::add_row(std::size_t start, const float* mask, int count) {
  std::size_t end = 0;  // of the last piece
  for (int x = 0; x < count; x += 8) {
    float any = 0.0f;
    for (int k = 0; k < 8; ++k) any += mask[x + k];
    if (any == 0.0f) continue;
    const std::size_t node = start + static_cast<std::size_t>(x);
    if (end != node) rows_.push_back({node, 0});
    rows_.back().count += 8;
    end = node + 8;
    nodes_ += 8;
  }
}

void PlateSolver::gather(const Level& level, const ContactRays& rays, std::uint32_t part,
                         const PlateSettings& settings) {
  const Grid& grid = level.grid;
  const auto place = [&](const ContactRay& ray) { return (ray.rim() - grid.low) / grid.cell; };
  const auto counts = [&](const ContactRay& ray) {
    if (ray.part != part || !(ray.value >= lost_rim)) return false;
    const Vec3f at = place(ray);
    const auto within = [](float x, int count) {
      return x >= static_cast<float>(border) && x < static_cast<float>(count - border - 1);
    };
    return within(at.x, grid.nx) && within(at.y, grid.ny) && within(at.z, grid.nz);
  };
  // Sorted by slab, in which they keep their order.
  rims_of_slab_.assign(static_cast<std::size_t>(grid.nz) + 1, 0);
  rim_ray_.clear();
  for (std::size_t i = 0; i < rays.rays.size(); i += settings.stride)
    if (counts(rays.rays[i])) {
      ++rims_of_slab_[static_cast<std::size_t>(place(rays.rays[i]).z) + 1];
      rim_ray_.push_back(static_cast<std::uint32_t>(i));
    }
  std::partial_sum(rims_of_slab_.begin(), rims_of_slab_.end(), rims_of_slab_.begin());
  const std::size_t count = (rim_ray_.size() + 7) / 8 * 8;
  rim_node_.assign(count, 0);
  for (auto* v : {&rim_x_, &rim_y_, &rim_z_}) v->assign(count, 0.0f);
  sorted_.resize(rim_ray_.size());
  for (const std::uint32_t i : rim_ray_) {
    const Vec3f at = place(rays.rays[i]);
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    const std::size_t to = rims_of_slab_[static_cast<std::size_t>(z)]++;
    sorted_[to] = i;
    rim_node_[to] = static_cast<std::int32_t>(grid.node(x, y, z));
    rim_x_[to] = at.x - static_cast<float>(x);
    rim_y_[to] = at.y - static_cast<float>(y);
    rim_z_[to] = at.z - static_cast<float>(z);
  }
  const auto each = static_cast<float>(settings.stride);
  rims_ = {rim_node_.data(),
           rim_x_.data(),
           rim_y_.data(),
           rim_z_.data(),
           count,
           static_cast<std::int32_t>(grid.row()),
           static_cast<std::int32_t>(grid.slab()),
           each * settings.value,
           each * settings.normal};
}

void PlateSolver::start(const Level& level, const ContactRays& rays, float tie) {
  for (const Row& row : rows_) {
    const float* __restrict hull = level.hull.data() + row.node;
    const float* __restrict f = level.values.data() + row.node;
    const float* __restrict mask = mask_.data() + row.node;
    float* __restrict residual = residual_.data() + row.node;
    for (int i = 0; i < row.count; ++i)
      residual[i] = mask[i] * tie * (hull[i] < 0.0f ? std::min(f[i], hull[i]) : f[i]);
    std::fill_n(solution_.data() + row.node, row.count, 0.0f);
  }
  const Grid& grid = level.grid;
  const std::size_t row = grid.row(), slab = grid.slab();
  for (std::size_t r = 0; r < sorted_.size(); ++r) {
    const Vec3f wanted = -rims_.normal * grid.cell * rays.rays[sorted_[r]].normal;
    const float a = rim_x_[r], b = rim_y_[r], c = rim_z_[r];
    const float along_x[2] = {1 - a, a}, along_y[2] = {1 - b, b}, along_z[2] = {1 - c, c};
    for (int k = 0; k < 8; ++k) {
      const int i = k & 1, j = k >> 1 & 1, l = k >> 2;
      const float p = along_x[i], q = along_y[j], s = along_z[l];
      const std::size_t node = static_cast<std::size_t>(rim_node_[r]) +
                               static_cast<std::size_t>(i) + static_cast<std::size_t>(j) * row +
                               static_cast<std::size_t>(l) * slab;
      const float x = q * s * wanted.x, y = p * s * wanted.y, z = p * q * wanted.z;
      residual_[node] += mask_[node] * ((i == 1 ? x : -x) + (j == 1 ? y : -y) + (l == 1 ? z : -z));
    }
  }
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
  const Loops& use = Loops::best();
  const double bent = sum_rows(threads, [&](std::size_t node, const PlateRow& row, float* sums) {
    use.laplacian(row, f + node, tie, laplacian_.data() + node, sums);
  });
  float lanes[8] = {};
  use.rims(rims_, f, more_.data(), lanes);
  double asked = 0.0;
  for (const float lane : lanes) asked += static_cast<double>(lane);
  return bent + asked;
}

double PlateSolver::step(const float* f, float tie, float length, int threads) {
  const Loops& use = Loops::best();
  return sum_rows(threads, [&](std::size_t node, const PlateRow& row, float* sums) {
    use.step(row, f + node, laplacian_.data() + node, tie, length, more_.data() + node,
             solution_.data() + node, residual_.data() + node, sums);
  });
}

/// Rims ask nodes that are not solved for, too, and the last ones of their eights node 0.
void PlateSolver::forget_rims() {
  for (const std::int32_t node : rim_node_)
    for (int k = 0; k < 4; ++k) {
      float* more = more_.data() + node + (k & 1 ? rims_.row : 0) + (k & 2 ? rims_.slab : 0);
      more[0] = more[1] = 0.0f;
    }
}

void PlateSolver::solve(Level& level, const ContactRays& rays, std::uint32_t part,
                        const PlateSettings& settings, int threads) {
  const float tie = settings.tie;
  set_up(level, settings);
  gather(level, rays, part, settings);
  start(level, rays, tie);
  // From 0 to f as it is, whatever the energy; then by conjugate gradients.
  bend(level.values.data(), tie, threads);
  double error = step(level.values.data(), tie, 1.0f, threads);
  float keep = 0.0f;
  for (int i = 0; i < settings.steps && error > 1e-11; ++i) {
    sum_rows(threads, [&](std::size_t node, const PlateRow& row, float*) {
      Loops::best().turn(row.count, residual_.data() + node, keep, direction_.data() + node);
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
    for (auto* v : {&laplacian_, &direction_}) std::fill_n(v->data() + row.node, count, 0.0f);
  }
  forget_rims();
}

}  // namespace polyhull::refine
