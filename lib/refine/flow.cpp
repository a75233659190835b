// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/flow.h"

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

void correct_row(const float* hull, const float* correction, int count, float* f) {
  for (int x = 0; x < count; ++x) {
    const float moved =
        std::clamp(std::min(f[x] + correction[x], hull[x] + above_hull), outside, deepest);
    f[x] = hull[x] <= outside - 0.4f ? outside : moved;
  }
}

}  // namespace

void blur(const Grid& grid, std::vector<float>& values, float sigma, FlowMemory& memory,
          int threads) {
  const Kernel kernel = gaussian(sigma, grid.cell);
  memory.along_x.resize(grid.size());
  memory.along_y.resize(grid.size());
  const auto slabs = static_cast<std::size_t>(grid.nz);
  const std::size_t row = grid.row(), slab = grid.slab();
  const int nx = grid.nx, ny = grid.ny;
  parallel_for(slabs, 4, threads, [&](std::size_t begin, std::size_t end) {
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
  parallel_for(slabs, 4, threads, [&](std::size_t begin, std::size_t end) {
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

void pull_to_rims(Level& level, const ContactRays& rays, std::uint32_t part, const Pull& pull,
                  FlowMemory& memory, int threads) {
  const Grid& grid = level.grid;
  // The coarser grid's nodes need not be the fine one's.
  const float cell = std::max(grid.cell, 0.8f * pull.sigma);
  const Grid coarse =
      grid_over(grid.low, grid.position(grid.nx - 1, grid.ny - 1, grid.nz - 1), cell, 1);
  memory.gaps.assign(coarse.size(), 0.0f);
  memory.weights.assign(coarse.size(), 0.0f);
  for (std::size_t i = 0; i < rays.rays.size(); i += pull.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value <= outside + 0.04f) continue;
    const Vec3f at = (ray.rim() - coarse.low) / cell;
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y), z = static_cast<int>(at.z);
    if (x < 0 || y < 0 || z < 0 || x >= coarse.nx - 1 || y >= coarse.ny - 1 || z >= coarse.nz - 1)
      continue;
    const float a = at.x - static_cast<float>(x), b = at.y - static_cast<float>(y),
                c = at.z - static_cast<float>(z);
    const float gap = pull.target - ray.value;
    for (int k = 0; k < 8; ++k) {
      const float w = ((k & 1) ? a : 1 - a) * ((k & 2) ? b : 1 - b) * ((k & 4) ? c : 1 - c);
      const std::size_t node = coarse.node(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
      memory.gaps[node] += w * gap;
      memory.weights[node] += w;
    }
  }
  blur(coarse, memory.gaps, pull.sigma, memory, threads);
  blur(coarse, memory.weights, pull.sigma, memory, threads);
  for (std::size_t i = 0; i < memory.gaps.size(); ++i)
    memory.gaps[i] = std::clamp(memory.gaps[i] / (memory.weights[i] + 0.002f), -1.25f, 1.7f);
  parallel_for(static_cast<std::size_t>(grid.nz), 4, threads,
               [&](std::size_t begin, std::size_t end) {
                 std::vector<float> corrections(grid.row()), mixed;
                 for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
                   for (int y = 0; y < grid.ny; ++y) {
                     sample_row(coarse, memory.gaps.data(), grid, y, z, mixed, corrections.data());
                     const std::size_t row = grid.node(0, y, z);
                     correct_row(level.hull.data() + row, corrections.data(), grid.nx,
                                 level.values.data() + row);
                   }
               });
}

}  // namespace polyhull::refine
