// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/fine_field.h"

#include <array>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// Nodes of the coarse grid that are less than this many cells outside may have finer ones inside.
constexpr float near_cells = 1.1f;
/// By how much the coarse H may be wrong near the hull, and fits may raise f.
constexpr float hull_near = 0.6f;
/// Where the coarse H is lower, nothing else needs to be known.
constexpr float surely_outside = -2.0f;
/// No fit lifts f from below this to above 0.
constexpr float never_inside = -1.2f;

/// Of a node's gradient and a rim's normal, the cosine below which they have nothing to do with each
/// other: the node is on the other side of a limb, say.
constexpr float least_along = 0.2f;

using Taps = std::array<float, 3>;
constexpr Taps even{0.125f, 0.75f, 0.125f}, odd{0.0f, 0.5f, 0.5f};

int clamped(int value, int count) {
  return std::clamp(value, 0, count - 1);
}

void lay_out(const Level& coarse, Level& fine) {
  const Grid& from = coarse.grid;
  Grid& to = fine.grid;
  to = {from.low, 0.5f * from.cell, 2 * from.nx, 2 * from.ny - 1, 2 * from.nz - 1};
  fine.values.assign(to.size(), outside);
  fine.hull.resize(to.size());
  fine.rows.assign(static_cast<std::size_t>(to.ny) * to.nz, {to.nx, 0});
  const float near = -near_cells * from.cell;
  for (int z = 0; z < from.nz; ++z)
    for (int y = 0; y < from.ny; ++y) {
      const float* row = coarse.values.data() + from.node(0, y, z);
      int begin = 0, end = from.nx;
      while (begin < end && row[begin] <= near) ++begin;
      while (end > begin && row[end - 1] <= near) --end;
      if (begin == end) continue;
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
          const int fy = 2 * y + dy, fz = 2 * z + dz;
          if (fy < 0 || fz < 0 || fy >= to.ny || fz >= to.nz) continue;
          Extent& extent = fine.rows[static_cast<std::size_t>(fz) * to.ny + fy];
          extent.begin = std::min(extent.begin, std::max(0, 2 * begin - 2));
          extent.end = std::max(extent.end, std::min(to.nx, 2 * end + 1));
        }
    }
  for (Extent& extent : fine.rows)
    if (extent.begin > extent.end) extent = {0, 0};
}

void interpolate_row(const Level& coarse, Level& fine, int y, int z, std::vector<float>& across) {
  const Grid& from = coarse.grid;
  const Extent extent = fine.rows[static_cast<std::size_t>(z) * fine.grid.ny + y];
  const int first = std::max(0, extent.begin / 2 - 1);
  const int last = std::min(from.nx - 1, extent.end / 2 + 1);
  std::fill(across.begin() + first, across.begin() + last + 1, 0.0f);
  const Taps& wy = y & 1 ? odd : even;
  const Taps& wz = z & 1 ? odd : even;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      const float w = wy[j] * wz[k];
      if (w == 0.0f) continue;
      const float* row = coarse.values.data() + from.node(0, clamped(y / 2 + j - 1, from.ny),
                                                          clamped(z / 2 + k - 1, from.nz));
      for (int x = first; x <= last; ++x) across[x] += w * row[x];
    }
  float* out = fine.values.data() + fine.grid.node(0, y, z);
  for (int x = extent.begin; x < extent.end; ++x) {
    const int c = x / 2;
    const float next = across[clamped(c + 1, from.nx)];
    out[x] = x & 1 ? 0.5f * (across[c] + next)
                   : 0.125f * (across[clamped(c - 1, from.nx)] + next) + 0.75f * across[c];
  }
}

/// What a row of nodes works with.
struct RowMemory {
  std::vector<float> across, x, exact;
};

/// Row (y, z) of the coarse H, linear between its nodes, at the coarse nodes' x.
void mix_hull(const Level& coarse, int y, int z, int first, int last, float* out) {
  const Grid& grid = coarse.grid;
  const float* rows[4];
  for (int k = 0; k < 4; ++k)
    rows[k] = coarse.hull.data() + grid.node(0, (y + (k & 1)) / 2, (z + (k >> 1)) / 2);
  for (int x = first; x <= last; ++x)
    out[x] = 0.25f * ((rows[0][x] + rows[1][x]) + (rows[2][x] + rows[3][x]));
}

void find_hull(const Level& coarse, const HullDistance& hull, Level& fine, int y, int z,
               RowMemory& memory) {
  const Grid& grid = fine.grid;
  const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
  const int last = coarse.grid.nx - 1;
  mix_hull(coarse, y, z, extent.begin / 2, std::min(last, extent.end / 2 + 1),
           memory.across.data());
  float* out = fine.hull.data() + grid.node(0, y, z);
  const float* f = fine.values.data() + grid.node(0, y, z);
  memory.x.clear();
  for (int x = extent.begin; x < extent.end; ++x) {
    out[x] = 1e6f;
    const float rough = 0.5f * (memory.across[x / 2] + memory.across[std::min(last, (x + 1) / 2)]);
    if (f[x] < never_inside || rough >= hull_near || rough >= f[x] + hull_near) continue;
    if (rough > surely_outside)
      memory.x.push_back(static_cast<float>(x));
    else
      out[x] = rough;
  }
  memory.exact.resize(memory.x.size());
  hull.exact_row(grid, static_cast<float>(y), static_cast<float>(z), memory.x, memory.exact.data());
  for (std::size_t i = 0; i < memory.x.size(); ++i)
    out[static_cast<int>(memory.x[i])] = memory.exact[i];
}

}  // namespace

void make_fine(const Level& coarse, const HullDistance& hull, Level& fine, int threads) {
  lay_out(coarse, fine);
  const Grid& grid = fine.grid;
  parallel_for(fine.rows.size(), 64, threads, [&](std::size_t begin, std::size_t end) {
    RowMemory memory;
    memory.across.resize(static_cast<std::size_t>(coarse.grid.nx));
    for (std::size_t r = begin; r < end; ++r) {
      if (fine.rows[r].begin == fine.rows[r].end) continue;
      const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
      interpolate_row(coarse, fine, y, z, memory.across);
      find_hull(coarse, hull, fine, y, z, memory);
    }
  });
}

void cut_at_hull(Level& fine, int threads) {
  const Grid& grid = fine.grid;
  parallel_for(fine.rows.size(), 64, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) {
      const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
      float* values = fine.values.data() + grid.node(0, y, z);
      const float* hull = fine.hull.data() + grid.node(0, y, z);
      const bool at_border = y == 0 || z == 0 || y == grid.ny - 1 || z == grid.nz - 1;
      for (int x = fine.rows[r].begin; x < fine.rows[r].end; ++x) {
        values[x] = std::min(values[x], hull[x]);
        if (at_border || x == 0 || x == grid.nx - 1) values[x] = outside;
      }
    }
  });
}

namespace {

/// The nodes of row \p r do what they are asked, and forget it.
void do_as_asked(Level& fine, std::size_t r, FitMemory& memory) {
  const std::size_t start = r * fine.grid.row();
  float* values = fine.values.data() + start;
  const float* hull = fine.hull.data() + start;
  float* sums = memory.sums.data() + start;
  float* weights = memory.weights.data() + start;
  for (int x = memory.asked[r].begin; x < memory.asked[r].end; ++x) {
    values[x] = std::min(values[x] + sums[x] / (weights[x] + 1e-3f), hull[x]);
    sums[x] = weights[x] = 0.0f;
  }
}

}  // namespace

void fit_to_rims(Level& fine, const ContactRays& rays, std::uint32_t part, const RimFit& fit,
                 FitMemory& memory, int threads) {
  const Grid& grid = fine.grid;
  if (memory.sums.size() < grid.size()) {
    memory.sums.resize(grid.size());
    memory.weights.resize(grid.size());
  }
  memory.asked.assign(fine.rows.size(), {});
  const auto slabs = static_cast<std::size_t>(grid.nz);
  memory.rays_of_slab.resize(std::max(memory.rays_of_slab.size(), slabs));
  for (auto& some : memory.rays_of_slab) some.clear();
  for (std::size_t i = 0; i < rays.rays.size(); i += fit.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value <= outside + 0.4f) continue;
    const auto z = static_cast<int>((ray.rim().z - grid.low.z) / grid.cell);
    if (z >= 0 && z < grid.nz) memory.rays_of_slab[z].push_back(static_cast<std::uint32_t>(i));
  }
  const float nodes = fit.radius / grid.cell;
  const int reach = static_cast<int>(nodes) + 1;
  parallel_for(slabs, 2, threads, [&](std::size_t begin, std::size_t end) {
    for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) {
      if (z == 0 || z == grid.nz - 1) continue;
      const std::size_t node = grid.node(0, 0, z), row = static_cast<std::size_t>(z) * grid.ny;
      const AskedSlab slab{fine.values.data() + node,
                           fine.rows.data() + row,
                           grid.nx,
                           grid.ny,
                           static_cast<float>(z),
                           memory.asked.data() + row,
                           memory.sums.data() + node,
                           memory.weights.data() + node};
      for (int k = std::max(0, z - reach); k <= std::min(grid.nz - 1, z + reach); ++k)
        for (const std::uint32_t i : memory.rays_of_slab[k]) {
          const ContactRay& ray = rays.rays[i];
          const Vec3f at = (ray.rim() - grid.low) / grid.cell;
          loops().ask({{at.x, at.y, at.z},
                       {ray.normal.x, ray.normal.y, ray.normal.z},
                       std::clamp(fit.target - ray.value, -0.8f, 1.25f),
                       nodes,
                       least_along},
                      slab);
        }
    }
  });
  parallel_for(fine.rows.size(), 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t r = begin; r < end; ++r) do_as_asked(fine, r, memory);
  });
}

}  // namespace polyhull::refine
