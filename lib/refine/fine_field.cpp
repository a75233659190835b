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

void find_hull(const Level& coarse, const HullDistance& hull, Level& fine, int y, int z) {
  const Grid& grid = fine.grid;
  const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
  for (int x = extent.begin; x < extent.end; ++x) {
    const std::size_t node = grid.node(x, y, z);
    float& value = fine.hull[node];
    value = 1e6f;
    const float f = fine.values[node];
    if (f < never_inside) continue;
    const Vec3f at = grid.position(x, y, z);
    const float rough = sample(coarse.grid, coarse.hull.data(), at);
    if (rough < hull_near && rough < f + hull_near) value = hull.exact(at, -1.0f);
  }
}

}  // namespace

void make_fine(const Level& coarse, const HullDistance& hull, Level& fine, int threads) {
  lay_out(coarse, fine);
  const Grid& grid = fine.grid;
  parallel_for(fine.rows.size(), 64, threads, [&](std::size_t begin, std::size_t end) {
    std::vector<float> across(static_cast<std::size_t>(coarse.grid.nx));
    for (std::size_t r = begin; r < end; ++r) {
      if (fine.rows[r].begin == fine.rows[r].end) continue;
      const int y = static_cast<int>(r) % grid.ny, z = static_cast<int>(r) / grid.ny;
      interpolate_row(coarse, fine, y, z, across);
      find_hull(coarse, hull, fine, y, z);
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

/// The nodes of slab \p z around one rim.
void ask_nodes(const Level& fine, const ContactRay& ray, float radius, float gap, int z,
               FitMemory& memory) {
  const Grid& grid = fine.grid;
  const float* f = fine.values.data();
  const std::size_t row = grid.row(), slab = grid.slab();
  const Vec3f rim = ray.rim();
  const Vec3f at = (rim - grid.low) / grid.cell;
  const float cells = radius / grid.cell;
  const int y0 = std::max(1, static_cast<int>(std::ceil(at.y - cells)));
  const int y1 = std::min(grid.ny - 2, static_cast<int>(std::floor(at.y + cells)));
  for (int y = y0; y <= y1; ++y) {
    const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
    const int x0 = std::max({1, extent.begin, static_cast<int>(std::ceil(at.x - cells))});
    const int x1 =
        std::min({grid.nx - 2, extent.end - 1, static_cast<int>(std::floor(at.x + cells))});
    for (int x = x0; x <= x1; ++x) {
      const Vec3f away = grid.position(x, y, z) - rim;
      const float share = 1.0f - glm::dot(away, away) / (radius * radius);
      if (!(share > 0.0f)) continue;
      const std::size_t node = grid.node(x, y, z);
      const Vec3f gradient(f[node + 1] - f[node - 1], f[node + row] - f[node - row],
                           f[node + slab] - f[node - slab]);
      const float length = glm::length(gradient);
      const float along = length > 0.0f ? -glm::dot(gradient, ray.normal) / length : 0.0f;
      if (along < least_along) continue;
      const float weight = along * share * share;
      memory.sums[node] += weight * gap;
      memory.weights[node] += weight;
    }
  }
}

}  // namespace

void fit_to_rims(Level& fine, const ContactRays& rays, std::uint32_t part, float radius,
                 float target, FitMemory& memory, int threads) {
  const Grid& grid = fine.grid;
  memory.sums.resize(grid.size());
  memory.weights.resize(grid.size());
  memory.rays_of_slab.resize(static_cast<std::size_t>(grid.nz));
  for (auto& some : memory.rays_of_slab) some.clear();
  for (std::size_t i = 0; i < rays.rays.size(); ++i) {
    const ContactRay& ray = rays.rays[i];
    if (ray.part != part || ray.value <= outside + 0.4f) continue;
    const auto z = static_cast<int>((ray.rim().z - grid.low.z) / grid.cell);
    if (z >= 0 && z < grid.nz) memory.rays_of_slab[z].push_back(static_cast<std::uint32_t>(i));
  }
  const int reach = static_cast<int>(radius / grid.cell) + 1;
  const auto each_slab = [&](const auto& body) {
    parallel_for(static_cast<std::size_t>(grid.nz), 2, threads,
                 [&](std::size_t begin, std::size_t end) {
                   for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) body(z);
                 });
  };
  const auto each_node = [&](int z, const auto& body) {
    for (int y = 0; y < grid.ny; ++y) {
      const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
      const std::size_t start = grid.node(0, y, z);
      for (int x = extent.begin; x < extent.end; ++x) body(start + static_cast<std::size_t>(x));
    }
  };
  each_slab([&](int z) {
    if (z == 0 || z == grid.nz - 1) return;
    for (int y = 0; y < grid.ny; ++y) {
      const Extent extent = fine.rows[static_cast<std::size_t>(z) * grid.ny + y];
      const auto start = static_cast<std::ptrdiff_t>(grid.node(0, y, z));
      for (auto* v : {&memory.sums, &memory.weights})
        std::fill(v->begin() + start + extent.begin, v->begin() + start + extent.end, 0.0f);
    }
    for (int k = std::max(0, z - reach); k <= std::min(grid.nz - 1, z + reach); ++k)
      for (const std::uint32_t i : memory.rays_of_slab[k]) {
        const ContactRay& ray = rays.rays[i];
        ask_nodes(fine, ray, radius, std::clamp(target - ray.value, -0.8f, 1.25f), z, memory);
      }
  });
  each_slab([&](int z) {
    if (z == 0 || z == grid.nz - 1) return;
    each_node(z, [&](std::size_t node) {
      fine.values[node] += memory.sums[node] / (memory.weights[node] + 1e-3f);
    });
  });
}

}  // namespace polyhull::refine
