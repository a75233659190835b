// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/cell_surface.h"

#include <array>
#include <cmath>

#include "base/thread_pool.h"
#include "refine/cell_table.h"

namespace polyhull::refine {
namespace {

/// How near to a node a vertex may come, in cells.
constexpr float nearest = 0.01f;

/// The nodes between which a row's cells, or edges to the next row and slab, can be crossed.
Extent joined(const Level& fine, int y, int z) {
  const Grid& grid = fine.grid;
  Extent all{grid.nx, 0};
  for (int dz = 0; dz < 2; ++dz)
    for (int dy = 0; dy < 2; ++dy) {
      if (y + dy >= grid.ny || z + dz >= grid.nz) continue;
      const Extent row = fine.rows[static_cast<std::size_t>(z + dz) * grid.ny + y + dy];
      if (row.begin == row.end) continue;
      all.begin = std::min(all.begin, row.begin);
      all.end = std::max(all.end, row.end);
    }
  return {std::max(0, all.begin - 1), std::min(grid.nx, all.end + 1)};
}

Vec3f gradient(const Grid& grid, const float* f, int x, int y, int z) {
  const auto difference = [&](int at, int count, std::size_t step) {
    const std::size_t node = grid.node(x, y, z);
    const std::size_t up = at + 1 < count ? node + step : node;
    const std::size_t down = at > 0 ? node - step : node;
    return (f[up] - f[down]) * (at > 0 && at + 1 < count ? 0.5f : 1.0f);
  };
  return {difference(x, grid.nx, 1), difference(y, grid.ny, grid.row()),
          difference(z, grid.nz, grid.slab())};
}

}  // namespace

void CellMarcher::find_vertices(const Level& fine, int z) {
  const Grid& grid = fine.grid;
  const float* f = fine.values.data();
  Slab& slab = slabs_[static_cast<std::size_t>(z)];
  slab.points.clear();
  slab.normals.clear();
  const std::size_t step[3] = {1, grid.row(), grid.slab()};
  for (int y = 0; y < grid.ny; ++y) {
    const Extent extent = joined(fine, y, z);
    for (int x = extent.begin; x < extent.end; ++x) {
      const std::size_t node = grid.node(x, y, z);
      const bool inside = f[node] > 0.0f;
      const bool can[3] = {x + 1 < grid.nx, y + 1 < grid.ny, z + 1 < grid.nz};
      for (int axis = 0; axis < 3; ++axis) {
        if (!can[axis] || (f[node + step[axis]] > 0.0f) == inside) continue;
        const float a = f[node], b = f[node + step[axis]];
        const float t = std::clamp(a / (a - b), nearest, 1.0f - nearest);
        Vec3f point = grid.position(x, y, z);
        point[axis] += t * grid.cell;
        const Vec3f here = gradient(grid, f, x, y, z);
        const Vec3f there = gradient(grid, f, x + (axis == 0), y + (axis == 1), z + (axis == 2));
        const Vec3f up = here + t * (there - here);
        const float length = glm::length(up);
        Vec3f normal(0.0f);
        if (length > 1e-12f)
          normal = -up / length;
        else
          normal[axis] = inside ? 1.0f : -1.0f;
        vertex_of_edge_[3 * node + axis] = static_cast<std::uint32_t>(slab.points.size());
        slab.points.push_back(point);
        slab.normals.push_back(normal);
      }
    }
  }
}

void CellMarcher::find_triangles(const Level& fine, int z) {
  const Grid& grid = fine.grid;
  const float* f = fine.values.data();
  Slab& slab = slabs_[static_cast<std::size_t>(z)];
  slab.triangles.clear();
  if (z + 1 >= grid.nz) return;
  const CellTable& table = cell_table();
  const std::uint32_t first[2] = {slab.first_vertex,
                                  slabs_[static_cast<std::size_t>(z) + 1].first_vertex};
  for (int y = 0; y + 1 < grid.ny; ++y) {
    const Extent extent = joined(fine, y, z);
    const float* rows[4];
    for (int k = 0; k < 4; ++k) rows[k] = f + grid.node(0, y + (k & 1), z + (k >> 1));
    for (int x = extent.begin; x + 1 < extent.end; ++x) {
      unsigned corners = 0;
      for (unsigned k = 0; k < 4; ++k)
        corners |= unsigned(rows[k][x] > 0.0f) << 2 * k | unsigned(rows[k][x + 1] > 0.0f)
                                                              << (2 * k + 1);
      if (corners == 0 || corners == 255) continue;
      for (const std::uint8_t edge : table.triangles(corners)) {
        const CellEdge& where = table.edge(edge);
        const std::size_t node = grid.node(x + where.x, y + where.y, z + where.z);
        slab.triangles.push_back(first[where.z] +
                                 vertex_of_edge_[3 * node + static_cast<std::size_t>(where.axis)]);
      }
    }
  }
}

void CellMarcher::march(const Level& fine, CellSurface& out, int threads) {
  const Grid& grid = fine.grid;
  vertex_of_edge_.resize(std::max(vertex_of_edge_.size(), 3 * grid.size()));
  slabs_.resize(std::max(slabs_.size(), static_cast<std::size_t>(grid.nz)));
  const auto each_slab = [&](const auto& body) {
    parallel_for(static_cast<std::size_t>(grid.nz), 2, threads,
                 [&](std::size_t begin, std::size_t end) {
                   for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) body(z);
                 });
  };
  each_slab([&](int z) { find_vertices(fine, z); });
  auto next = static_cast<std::uint32_t>(out.points.size());
  for (int z = 0; z < grid.nz; ++z) {
    slabs_[static_cast<std::size_t>(z)].first_vertex = next;
    next += static_cast<std::uint32_t>(slabs_[static_cast<std::size_t>(z)].points.size());
  }
  each_slab([&](int z) { find_triangles(fine, z); });
  for (int z = 0; z < grid.nz; ++z) {
    const Slab& slab = slabs_[static_cast<std::size_t>(z)];
    out.points.insert(out.points.end(), slab.points.begin(), slab.points.end());
    out.normals.insert(out.normals.end(), slab.normals.begin(), slab.normals.end());
    out.triangles.insert(out.triangles.end(), slab.triangles.begin(), slab.triangles.end());
  }
}

}  // namespace polyhull::refine
