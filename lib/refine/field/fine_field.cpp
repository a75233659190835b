// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/fine_field.h"

#include <array>
#include <cmath>

#include "base/thread_pool.h"

namespace polyhull::refine {
namespace {

/// Nodes of the coarse grid that are less than this many cells outside may have finer ones inside.
constexpr float near_cells = 1.1f;
/// Where the coarse H is lower, no node beside it is inside, and nothing else needs to be known.
constexpr float surely_outside = -1.1f;
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

/// `outside` everywhere: only the rows' nodes can be something else.
void forget(Level& fine) {
  for (std::size_t r = 0; r < fine.rows.size(); ++r) {
    float* row = fine.values.data() + r * fine.grid.row();
    std::fill(row + fine.rows[r].begin, row + fine.rows[r].end, outside);
  }
}

void lay_out(const Level& coarse, Level& fine) {
  forget(fine);
  const Grid& from = coarse.grid;
  Grid& to = fine.grid;
  to = {from.low, 0.5f * from.cell, 2 * from.nx, 2 * from.ny - 1, 2 * from.nz - 1};
  fine.values.resize(std::max(fine.values.size(), to.size()), outside);
  fine.hull.resize(fine.values.size());
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
          extent.end = std::max(extent.end, std::min(to.nx, 2 * end + 2));
        }
    }
  for (Extent& extent : fine.rows)
    if (extent.begin > extent.end) extent = {0, 0};
}

/// What a row of nodes works with.
struct RowMemory {
  std::vector<float> across;  // of the coarse grid's nodes, one before the first and after the last
  std::vector<float> rough, x, exact;
};

/// Row (y, z) of the fine values, from the coarse ones.
void interpolate_row(const Level& coarse, Level& fine, int y, int z, RowMemory& memory) {
  const Grid& from = coarse.grid;
  const Extent extent = fine.rows[static_cast<std::size_t>(z) * fine.grid.ny + y];
  const int first = std::max(0, extent.begin / 2 - 1);
  const int last = std::min(from.nx - 1, extent.end / 2 + 1);
  float* across = memory.across.data() + 1;
  std::fill(across + first, across + last + 1, 0.0f);
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
  if (first == 0) across[-1] = across[0];
  if (last == from.nx - 1) across[from.nx] = across[last];
  float* __restrict out = fine.values.data() + fine.grid.node(0, y, z);
  for (int c = extent.begin / 2; c < extent.end / 2; ++c) {
    out[2 * c] = 0.125f * (across[c - 1] + across[c + 1]) + 0.75f * across[c];
    out[2 * c + 1] = 0.5f * (across[c] + across[c + 1]);
  }
}

/// Row (y, z) of the coarse H, linear between its nodes, at the fine nodes.
void mix_hull(const Level& coarse, int y, int z, const Extent& extent, RowMemory& memory) {
  const Grid& grid = coarse.grid;
  const float* rows[4];
  for (int k = 0; k < 4; ++k)
    rows[k] = coarse.hull.data() + grid.node(0, (y + (k & 1)) / 2, (z + (k >> 1)) / 2);
  const int first = extent.begin / 2, last = std::min(grid.nx - 1, extent.end / 2);
  float* across = memory.across.data() + 1;
  for (int x = first; x <= last; ++x)
    across[x] = 0.25f * ((rows[0][x] + rows[1][x]) + (rows[2][x] + rows[3][x]));
  if (last == grid.nx - 1) across[grid.nx] = across[last];
  float* __restrict rough = memory.rough.data();
  for (int c = first; c < extent.end / 2; ++c) {
    rough[2 * c] = across[c];
    rough[2 * c + 1] = 0.5f * (across[c] + across[c + 1]);
  }
}

void find_hull(const Level& coarse, const HullRows& hull, Level& fine, int y, int z,
               RowMemory& memory) {
  const Grid& grid = fine.grid;
  const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
  mix_hull(coarse, y, z, extent, memory);
  float* __restrict out = fine.hull.data() + grid.node(0, y, z);
  const float* __restrict f = fine.values.data() + grid.node(0, y, z);
  const float* __restrict rough = memory.rough.data();
  // Where H matters what the coarse one says, else far inside.
  for (int x = extent.begin; x < extent.end; ++x) {
    const float below = f[x] < 0.0f ? f[x] + hull_near : hull_near;
    out[x] = (f[x] >= never_inside) & (rough[x] < below) ? rough[x] : hull_far;
  }
  memory.x.resize(grid.row());
  std::size_t count = 0;
  for (int x = extent.begin; x < extent.end; ++x) {
    memory.x[count] = static_cast<float>(x);
    count += (out[x] > surely_outside) & (out[x] < hull_far);
  }
  memory.x.resize(count);
  memory.exact.resize(memory.x.size());
  hull.find(grid, static_cast<float>(y), static_cast<float>(z), memory.x, memory.exact.data());
  for (std::size_t i = 0; i < memory.x.size(); ++i)
    out[static_cast<int>(memory.x[i])] = memory.exact[i];
}

}  // namespace

void make_fine(const Level& coarse, const HullDistance& hull, Level& fine, int threads) {
  lay_out(coarse, fine);
  const Grid& grid = fine.grid;
  const HullRows rows(hull, HullRows::By::exact);
  parallel_for(fine.rows.size(), 64, threads, [&](std::size_t begin, std::size_t end) {
    RowMemory memory;
    memory.across.resize(coarse.grid.row() + 2);
    memory.rough.resize(grid.row());
    for (std::size_t r = begin; r < end; ++r) {
      if (fine.rows[r].begin == fine.rows[r].end) continue;
      const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
      interpolate_row(coarse, fine, y, z, memory);
      find_hull(coarse, rows, fine, y, z, memory);
    }
  });
}

void cut_at_hull(Level& fine, int threads) {
  const Grid& grid = fine.grid;
  parallel_each(fine.rows.size(), 64, threads, [&](std::size_t r) {
    const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
    float* values = fine.values.data() + grid.node(0, y, z);
    const float* hull = fine.hull.data() + grid.node(0, y, z);
    const bool at_border = y == 0 || z == 0 || y == grid.ny - 1 || z == grid.nz - 1;
    for (int x = fine.rows[r].begin; x < fine.rows[r].end; ++x) {
      values[x] = std::min(values[x], hull[x]);
      if (at_border || x == 0 || x == grid.nx - 1) values[x] = outside;
    }
  });
}

namespace {

/// The nodes of row \p r do what they are asked, and forget it.
void do_as_asked(Level& fine, std::size_t r, FitMemory& memory) {
  const std::size_t start = r * fine.grid.row();
  float* values = fine.values.data() + start;
  const float* hull = fine.hull.data() + start;
  const Extent extent = memory.asked[r];
  for (int x = extent.begin / 8 * 8; x < extent.end; x += 8) {
    float* asks = memory.asks.data() + 2 * (start + static_cast<std::size_t>(x));
    for (int k = 0; k < 8; ++k) {
      const float moved = std::min(values[x + k] + asks[k] / (asks[8 + k] + 1e-3f), hull[x + k]);
      values[x + k] = asks[8 + k] > 0.0f ? moved : values[x + k];
    }
    for (int k = 0; k < 16; ++k) asks[k] = 0.0f;
  }
}

}  // namespace

void fit_to_rims(Level& fine, const ContactRays& rays, std::uint32_t part, const RimFit& fit,
                 FitMemory& memory, int threads) {
  const Grid& grid = fine.grid;
  memory.asks.make_room(2 * grid.size());
  memory.asked.assign(fine.rows.size(), {});
  const auto slabs = static_cast<std::size_t>(grid.nz);
  const float nodes = fit.radius / grid.cell;
  memory.rims_of_slab.resize(std::max(memory.rims_of_slab.size(), slabs));
  for (auto& some : memory.rims_of_slab) some.clear();
  for (std::size_t i = 0; i < rays.rays.size(); i += fit.stride) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value <= outside + 0.4f) continue;
    const Vec3f at = (ray.rim() - grid.low) / grid.cell;
    const auto z = static_cast<int>(at.z);
    if (z >= 0 && z < grid.nz)
      memory.rims_of_slab[z].push_back({{at.x, at.y, at.z},
                                        {ray.normal.x, ray.normal.y, ray.normal.z},
                                        std::clamp(fit.target - ray.value, -0.8f, 1.25f),
                                        nodes,
                                        least_along});
  }
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
                           memory.asks.data() + 2 * node};
      for (int k = std::max(0, z - reach); k <= std::min(grid.nz - 1, z + reach); ++k)
        for (const AskingRim& rim : memory.rims_of_slab[k]) Loops::best().ask(rim, slab);
    }
  });
  parallel_each(fine.rows.size(), 256, threads,
                [&](std::size_t r) { do_as_asked(fine, r, memory); });
}

}  // namespace polyhull::refine
