// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/flow.h"

#include <array>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

constexpr int most_taps = 6;
/// f may exceed H by this much: the surface is cut at the hull at the end only.
constexpr float above_hull = 0.4f;

struct Kernel {
  int reach = 0;
  std::array<float, most_taps + 1> weight{};
};

Kernel gaussian(float sigma, float cell) {
  Kernel kernel;
  const float s = sigma / cell;
  kernel.reach = std::min(most_taps, static_cast<int>(std::ceil(2.4f * s)));
  float sum = 0.0f;
  for (int k = 0; k <= kernel.reach; ++k) {
    const auto x = static_cast<float>(k);
    kernel.weight[k] = std::exp(-0.5f * x * x / (s * s));
    sum += (k == 0 ? 1.0f : 2.0f) * kernel.weight[k];
  }
  for (float& w : kernel.weight) w /= sum;
  return kernel;
}

void weigh(const float* __restrict middle, int count, float weight, float* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] = weight * middle[i];
}

void add(const float* __restrict a, const float* __restrict b, int count, float weight,
         float* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] += weight * (a[i] + b[i]);
}

void blur_x(const Kernel& kernel, const float* row, int count, std::vector<float>& wide,
            float* to) {
  const int reach = kernel.reach;
  wide.resize(static_cast<std::size_t>(count + 2 * reach));
  std::fill_n(wide.begin(), reach, row[0]);
  std::copy_n(row, count, wide.begin() + reach);
  std::fill_n(wide.begin() + reach + count, reach, row[count - 1]);
  weigh(wide.data() + reach, count, kernel.weight[0], to);
  for (int k = 1; k <= reach; ++k)
    add(wide.data() + reach - k, wide.data() + reach + k, count, kernel.weight[k], to);
}

void add_one(const float* __restrict a, int count, float weight, float* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] += weight * a[i];
}

void correct_row(const float* __restrict hull, const float* __restrict correction, int count,
                 float* __restrict f) {
  for (int x = 0; x < count; ++x)
    f[x] = std::clamp(std::min(f[x] + correction[x], hull[x] + above_hull), outside, deepest);
}

/// Slabs that are worth a piece of work of their own.
std::size_t slabs_of_a_piece(const Grid& grid) {
  return std::max<std::size_t>(4, 16384 / grid.slab());
}

/// What rows hold whose neighbours within \p reach rows, \p step apart, of \p count in a line, hold
/// \p from.
void widen(const std::vector<Extent>& from, std::size_t step, std::size_t count, int reach,
           std::vector<Extent>& to) {
  to.assign(from.size(), {});
  for (std::size_t r = 0; r < from.size(); ++r) {
    const Extent& held = from[r];
    if (held.begin == held.end) continue;
    const auto at = static_cast<int>(r / step % count);
    for (int k = -std::min(reach, at); k <= std::min(reach, static_cast<int>(count) - 1 - at); ++k)
      to[r + static_cast<std::size_t>(k) * step].include(held);
  }
}

/// A blur of what is 0 but for some nodes of each row.
class SparseBlur {
 public:
  SparseBlur(const Grid& grid, float sigma, const std::vector<Extent>& held, FlowMemory& memory)
      : grid_(grid), kernel_(gaussian(sigma, grid.cell)), memory_(memory) {
    memory.rows_x = held;
    for (Extent& extent : memory.rows_x)
      if (extent.begin < extent.end)
        extent = {std::max(0, extent.begin - kernel_.reach),
                  std::min(grid.nx, extent.end + kernel_.reach)};
    const auto ny = static_cast<std::size_t>(grid.ny), nz = static_cast<std::size_t>(grid.nz);
    widen(memory.rows_x, 1, ny, kernel_.reach, memory.rows_y);
    widen(memory.rows_y, ny, nz, kernel_.reach, memory.rows_z);
    memory.along_x.resize(grid.size());
    memory.along_y.resize(grid.size());
  }

  /// Of \p values, 0 but for the nodes held; which nodes are not 0 then rows_z says.
  void apply(std::vector<float>& values, int threads) {
    const auto slabs = static_cast<std::size_t>(grid_.nz);
    const std::size_t grain = slabs_of_a_piece(grid_), ny = static_cast<std::size_t>(grid_.ny);
    parallel_for(slabs, grain, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin * ny; r < end * ny; ++r) row_along_x(r, values.data());
      for (std::size_t r = begin * ny; r < end * ny; ++r)
        row_across(r, 1, ny, memory_.rows_x, memory_.rows_y, memory_.along_x.data(),
                   memory_.along_y.data());
    });
    parallel_for(slabs, grain, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin * ny; r < end * ny; ++r)
        row_across(r, ny, slabs, memory_.rows_y, memory_.rows_z, memory_.along_y.data(),
                   values.data());
    });
  }

 private:
  void row_along_x(std::size_t r, const float* values) {
    const Extent extent = memory_.rows_x[r];
    if (extent.begin == extent.end) return;
    const float* row = values + r * grid_.row();
    float* out = memory_.along_x.data() + r * grid_.row();
    std::fill(out + extent.begin, out + extent.end, 0.0f);
    for (int k = -kernel_.reach; k <= kernel_.reach; ++k) {
      const int begin = std::max(extent.begin, -k), end = std::min(extent.end, grid_.nx - k);
      add_one(row + begin + k, end - begin, kernel_.weight[std::abs(k)], out + begin);
    }
  }
  void row_across(std::size_t r, std::size_t step, std::size_t count,
                  const std::vector<Extent>& held, const std::vector<Extent>& wanted,
                  const float* from, float* to) {
    const Extent extent = wanted[r];
    if (extent.begin == extent.end) return;
    float* out = to + r * grid_.row();
    std::fill(out + extent.begin, out + extent.end, 0.0f);
    const auto at = static_cast<int>(r / step % count);
    for (int k = -kernel_.reach; k <= kernel_.reach; ++k) {
      if (at + k < 0 || at + k >= static_cast<int>(count)) continue;
      const std::size_t other = r + static_cast<std::size_t>(k) * step;
      const Extent some = held[other];
      add_one(from + other * grid_.row() + some.begin, some.end - some.begin,
              kernel_.weight[std::abs(k)], out + some.begin);
    }
  }

  const Grid& grid_;
  Kernel kernel_;
  FlowMemory& memory_;
};

}  // namespace

void blur(const Grid& grid, std::vector<float>& values, float sigma, FlowMemory& memory,
          int threads) {
  const Kernel kernel = gaussian(sigma, grid.cell);
  memory.along_x.resize(grid.size());
  memory.along_y.resize(grid.size());
  const auto slabs = static_cast<std::size_t>(grid.nz);
  const std::size_t row = grid.row(), slab = grid.slab();
  const int nx = grid.nx, ny = grid.ny;
  parallel_for(slabs, slabs_of_a_piece(grid), threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> wide;
    for (std::size_t z = begin; z < end; ++z) {
      float* blurred = memory.along_x.data() + z * slab;
      for (int y = 0; y < ny; ++y)
        blur_x(kernel, values.data() + z * slab + y * row, nx, wide, blurred + y * row);
      for (int y = 0; y < ny; ++y) {
        float* to = memory.along_y.data() + z * slab + y * row;
        weigh(blurred + y * row, nx, kernel.weight[0], to);
        for (int k = 1; k <= kernel.reach; ++k)
          add(blurred + std::max(0, y - k) * row, blurred + std::min(ny - 1, y + k) * row, nx,
              kernel.weight[k], to);
      }
    }
  });
  const int nz = grid.nz;
  parallel_for(slabs, slabs_of_a_piece(grid), threads, [&](std::size_t begin, std::size_t end) {
    const auto count = static_cast<int>(slab);
    for (std::size_t z = begin; z < end; ++z) {
      float* to = values.data() + z * slab;
      const auto at = static_cast<int>(z);
      weigh(memory.along_y.data() + z * slab, count, kernel.weight[0], to);
      for (int k = 1; k <= kernel.reach; ++k)
        add(memory.along_y.data() + std::max(0, at - k) * slab,
            memory.along_y.data() + std::min(nz - 1, at + k) * slab, count, kernel.weight[k], to);
    }
  });
}

namespace {

/// Spreads the gaps of \p part's rims and their weights over the nodes of \p coarse.
void spread_gaps(const Grid& coarse, const ContactRays& rays, std::uint32_t part, const Pull& pull,
                 FlowMemory& memory) {
  memory.gaps.assign(coarse.size(), 0.0f);
  memory.weights.assign(coarse.size(), 0.0f);
  memory.held.assign(static_cast<std::size_t>(coarse.ny) * coarse.nz, {});
  for (std::size_t i = 0; i < rays.rays.size(); i += pull.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value <= outside + 0.04f) continue;
    const Vec3f at = (ray.rim() - coarse.low) / coarse.cell;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    if (x < 0 || y < 0 || z < 0 || x >= coarse.nx - 1 || y >= coarse.ny - 1 || z >= coarse.nz - 1)
      continue;
    const float a = at.x - static_cast<float>(x), b = at.y - static_cast<float>(y),
                c = at.z - static_cast<float>(z);
    const float gap = pull.target - ray.value;
    for (int k = 0; k < 4; ++k) {
      const std::size_t node = coarse.node(x, y + (k & 1), z + (k >> 1));
      memory.held[static_cast<std::size_t>(z + (k >> 1)) * coarse.ny + y + (k & 1)].include(
          {x, x + 2});
      for (int i = 0; i < 2; ++i) {
        const float w = (i ? a : 1 - a) * ((k & 1) ? b : 1 - b) * ((k & 2) ? c : 1 - c);
        memory.gaps[node + i] += w * gap;
        memory.weights[node + i] += w;
      }
    }
  }
}

}  // namespace

void pull_to_rims(Level& level, const ContactRays& rays, std::uint32_t part, const Pull& pull,
                  FlowMemory& memory, int threads) {
  const Grid& grid = level.grid;
  const bool same = grid.cell >= pull.sigma;  // else the coarser grid's nodes need not be these
  const Grid coarse =
      same ? grid
           : grid_over(grid.low, grid.position(grid.nx - 1, grid.ny - 1, grid.nz - 1), pull.sigma,
                       1);
  spread_gaps(coarse, rays, part, pull, memory);
  SparseBlur blur(coarse, pull.sigma, memory.held, memory);
  blur.apply(memory.gaps, threads);
  blur.apply(memory.weights, threads);
  for (std::size_t r = 0; r < memory.rows_z.size(); ++r)
    for (int x = memory.rows_z[r].begin; x < memory.rows_z[r].end; ++x) {
      const std::size_t node = r * coarse.row() + static_cast<std::size_t>(x);
      memory.gaps[node] =
          std::clamp(memory.gaps[node] / (memory.weights[node] + 0.002f), -1.25f, 1.7f);
    }
  parallel_for(static_cast<std::size_t>(grid.nz), slabs_of_a_piece(grid), threads,
               [&](std::size_t begin, std::size_t end) {
                 std::vector<float> corrections(grid.row()), mixed;
                 for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
                   for (int y = 0; y < grid.ny; ++y) {
                     const std::size_t row = grid.node(0, y, z);
                     each_stretch(level, row / grid.row(), least_hull, [&](Extent nodes) {
                       const float* by = same ? memory.gaps.data() + row : corrections.data();
                       if (!same)
                         sample_row(coarse, memory.gaps.data(), grid, y, z, nodes, mixed,
                                    corrections.data());
                       correct_row(level.hull.data() + row + nodes.begin, by + nodes.begin,
                                   nodes.end - nodes.begin,
                                   level.values.data() + row + nodes.begin);
                     });
                   }
               });
}

}  // namespace polyhull::refine
