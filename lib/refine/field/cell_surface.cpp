// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/cell_surface.h"

#include <bit>
#include <cmath>

#include "base/thread_pool.h"
#include "refine/field/cell_table.h"

namespace polyhull::refine {
namespace {

/// How many of a node's crossed edges come before that of an axis, by which are crossed.
constexpr std::uint8_t crossed_before[8][3] = {{0, 0, 0}, {0, 1, 1}, {0, 0, 1}, {0, 1, 2},
                                               {0, 0, 0}, {0, 1, 1}, {0, 0, 1}, {0, 1, 2}};

/// Calls body(x) for each bit.
template <typename Body>
void each_bit(std::uint64_t bits, std::size_t word, const Body& body) {
  for (; bits != 0; bits &= bits - 1) body(static_cast<int>(64 * word) + std::countr_zero(bits));
}

/// Which nodes of a row of \p nx have a next one.
std::uint64_t with_next(int nx, std::size_t word) {
  const int left = nx - 1 - static_cast<int>(64 * word);
  return left >= 64 ? ~std::uint64_t{0} : left <= 0 ? 0 : (std::uint64_t{1} << left) - 1;
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

void Signs::find(const Level& fine, float above, int threads) {
  const Grid& grid = fine.grid;
  words = (grid.row() + 63) / 64;
  bits.assign(fine.rows.size() * words, 0);
  parallel_each(fine.rows.size(), 256, threads, [&](std::size_t r) {
    const Extent extent = fine.rows[r];
    const int begin = extent.begin / 64 * 64, end = (extent.end + 7) / 8 * 8;
    Loops::best().signs(fine.values.data() + r * grid.row() + begin, above, end - begin,
                        bits.data() + r * words + begin / 64);
  });
}

Vec3f surface_normal(const Grid& grid, const float* f, int x, int y, int z, int axis, float along) {
  const Vec3f here = gradient(grid, f, x, y, z);
  const Vec3f there = gradient(grid, f, x + (axis == 0), y + (axis == 1), z + (axis == 2));
  const Vec3f up = here + along * (there - here);
  const float length = glm::length(up);
  if (length > 1e-12f) return -up / length;
  Vec3f normal(0.0f);
  normal[axis] = f[grid.node(x, y, z)] > 0.0f ? 1.0f : -1.0f;
  return normal;
}

void CellMarcher::add_vertex(const Level& fine, int x, int y, int z, int axis) {
  const Grid& grid = fine.grid;
  const float* f = fine.values.data();
  Slab& slab = slabs_[static_cast<std::size_t>(z)];
  const std::size_t node = grid.node(x, y, z);
  const std::size_t step[3] = {1, grid.row(), grid.slab()};
  const float t = crossing(f[node], f[node + step[axis]]);
  Vec3f point = grid.position(x, y, z);
  point[axis] += t * grid.cell;
  slab.points.push_back(point);
  slab.normals.push_back(surface_normal(grid, f, x, y, z, axis, t));
}

void CellMarcher::find_vertices(const Level& fine, int z) {
  const Grid& grid = fine.grid;
  slabs_[static_cast<std::size_t>(z)].points.clear();
  slabs_[static_cast<std::size_t>(z)].normals.clear();
  for (int y = 0; y < grid.ny; ++y) {
    const std::uint64_t *own = signs_.row(grid, y, z), *above = signs_.row(grid, y + 1, z),
                        *behind = signs_.row(grid, y, z + 1);
    for (std::size_t w = 0; w < signs_.words; ++w) {
      const std::uint64_t crossed[3] = {
          (own[w] ^ next_bits(own, w, signs_.words)) & with_next(grid.nx, w), own[w] ^ above[w],
          own[w] ^ behind[w]};
      each_bit(crossed[0] | crossed[1] | crossed[2], w, [&](int x) {
        unsigned axes = 0;
        for (unsigned axis = 0; axis < 3; ++axis) axes |= (crossed[axis] >> x % 64 & 1) << axis;
        const auto first =
            static_cast<std::uint32_t>(slabs_[static_cast<std::size_t>(z)].points.size());
        vertices_of_node_[grid.node(x, y, z)] = first << 3 | axes;
        for (int axis = 0; axis < 3; ++axis)
          if (axes >> axis & 1) add_vertex(fine, x, y, z, axis);
      });
    }
  }
}

void CellMarcher::find_triangles(const Level& fine, int z) {
  const Grid& grid = fine.grid;
  Slab& slab = slabs_[static_cast<std::size_t>(z)];
  slab.triangles.clear();
  if (z + 1 >= grid.nz) return;
  const std::uint32_t first[2] = {slab.first_vertex,
                                  slabs_[static_cast<std::size_t>(z) + 1].first_vertex};
  const CellTable& table = cell_table();
  const auto add_cell = [&](int x, int y, unsigned corners) {
    for (const std::uint8_t edge : table.triangles(corners)) {
      const CellEdge& where = table.edge(edge);
      const std::size_t node = grid.node(x + where.x, y + where.y, z + where.z);
      const std::uint32_t vertices = vertices_of_node_[node];
      slab.triangles.push_back(first[where.z] + (vertices >> 3) +
                               crossed_before[vertices & 7][where.axis]);
    }
  };
  for (int y = 0; y + 1 < grid.ny; ++y)
    for (std::size_t w = 0; w < signs_.words; ++w) {
      std::uint64_t corner[8], any = 0, every = ~std::uint64_t{0};
      for (int k = 0; k < 8; ++k) {
        const std::uint64_t* row = signs_.row(grid, y + (k >> 1 & 1), z + (k >> 2));
        corner[k] = k & 1 ? next_bits(row, w, signs_.words) : row[w];
        any |= corner[k];
        every &= corner[k];
      }
      each_bit(any & ~every & with_next(grid.nx, w), w, [&](int x) {
        unsigned corners = 0;
        for (unsigned k = 0; k < 8; ++k) corners |= unsigned(corner[k] >> x % 64 & 1) << k;
        add_cell(x, y, corners);
      });
    }
}

void CellMarcher::march(const Level& fine, CellSurface& out, int threads) {
  const Grid& grid = fine.grid;
  vertices_of_node_.resize(std::max(vertices_of_node_.size(), grid.size()));
  slabs_.resize(std::max(slabs_.size(), static_cast<std::size_t>(grid.nz)));
  const auto each_slab = [&](const auto& body) {
    parallel_for(static_cast<std::size_t>(grid.nz), 2, threads,
                 [&](std::size_t begin, std::size_t end) {
                   for (auto z = static_cast<int>(begin); z < static_cast<int>(end); ++z) body(z);
                 });
  };
  signs_.find(fine, 0.0f, threads);
  each_slab([&](int z) { find_vertices(fine, z); });
  auto next = static_cast<std::uint32_t>(out.points.size());
  for (int z = 0; z < grid.nz; ++z) {
    slabs_[static_cast<std::size_t>(z)].first_vertex = next;
    next += static_cast<std::uint32_t>(slabs_[static_cast<std::size_t>(z)].points.size());
  }
  each_slab([&](int z) { find_triangles(fine, z); });
  gather(out, grid, threads);
}

/// Appends what the slabs found.
void CellMarcher::gather(CellSurface& out, const Grid& grid, int threads) {
  const auto slabs = static_cast<std::size_t>(grid.nz);
  std::vector<std::size_t> first_point(slabs + 1, out.points.size());
  std::vector<std::size_t> first_corner(slabs + 1, out.triangles.size());
  for (std::size_t z = 0; z < slabs; ++z) {
    first_point[z + 1] = first_point[z] + slabs_[z].points.size();
    first_corner[z + 1] = first_corner[z] + slabs_[z].triangles.size();
  }
  out.points.resize(first_point.back());
  out.normals.resize(first_point.back());
  out.triangles.resize(first_corner.back());
  parallel_each(slabs, 8, threads, [&](std::size_t z) {
    const Slab& slab = slabs_[z];
    std::copy(slab.points.begin(), slab.points.end(), out.points.data() + first_point[z]);
    std::copy(slab.normals.begin(), slab.normals.end(), out.normals.data() + first_point[z]);
    std::copy(slab.triangles.begin(), slab.triangles.end(), out.triangles.data() + first_corner[z]);
  });
}

}  // namespace polyhull::refine
