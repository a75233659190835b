// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/figure/polygons/polygonise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "base/error.h"
#include "base/thread_pool.h"

namespace polyhull {
namespace {

constexpr int block = 8;  // cells along an edge of a block that is skipped or filled as a whole

/// Corners of the six tetrahedra of a cube, as bit masks x = 1, y = 2, z = 4; all positively
/// oriented.
constexpr std::array<std::array<int, 4>, 6> tetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

struct Grid {
  Vec3f min;
  float step;
  std::array<int, 3> size;  // grid points along x, y, z
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * size[1] + y) * size[0] + x;
  }
  Vec3f position(int x, int y, int z) const { return min + step * Vec3f(x, y, z); }
  Vec3f position(std::size_t i) const {
    const int x = static_cast<int>(i % size[0]);
    const int y = static_cast<int>(i / size[0] % size[1]);
    return position(x, y, static_cast<int>(i / size[0] / size[1]));
  }
};

/// Values at the grid points; blocks that the level cannot reach hold one rough value.
std::vector<float> sample(const std::function<float(const Vec3f&)>& value, const Grid& grid) {
  std::vector<float> values(static_cast<std::size_t>(grid.size[0]) * grid.size[1] * grid.size[2]);
  const int blocks_z = (grid.size[2] + block - 1) / block;
  parallel_for(blocks_z, 1, 0, [&](std::size_t begin, std::size_t end) {
    for (int z0 = static_cast<int>(begin) * block; z0 < static_cast<int>(end) * block;
         z0 += block) {
      for (int y0 = 0; y0 < grid.size[1]; y0 += block) {
        for (int x0 = 0; x0 < grid.size[0]; x0 += block) {
          const float half = 0.5f * block;
          const float rough = value(grid.min + grid.step * Vec3f(x0 + half, y0 + half, z0 + half));
          // One more cell around: both ends of each edge must be known where the level passes.
          const bool far = std::abs(rough) > 1.7f * 1.7321f * (half + 1.0f) * grid.step;
          for (int z = z0; z < std::min(z0 + block, grid.size[2]); ++z) {
            for (int y = y0; y < std::min(y0 + block, grid.size[1]); ++y)
              for (int x = x0; x < std::min(x0 + block, grid.size[0]); ++x)
                values[grid.index(x, y, z)] = far ? rough : value(grid.position(x, y, z));
          }
        }
      }
    }
  });
  return values;
}

class Marcher {
 public:
  Marcher(const Grid& grid, const std::vector<float>& values) : grid_(grid), values_(values) {}

  void cube(int x, int y, int z) {
    std::array<std::size_t, 8> at;
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      at[c] = grid_.index(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
      inside += values_[at[c]] < 0.0f;
    }
    if (inside == 0 || inside == 8) return;
    for (const auto& corners : tetrahedra)
      tetrahedron({at[corners[0]], at[corners[1]], at[corners[2]], at[corners[3]]});
  }

  TriangleMesh take() { return std::move(mesh_); }

 private:
  void tetrahedron(std::array<std::size_t, 4> at) {
    // Inside corners first, by swaps that come in pairs so that the orientation stays.
    int inside = 0;
    int swaps = 0;
    for (int i = 0; i < 4; ++i) {
      if (values_[at[i]] < 0.0f) {
        if (i != inside) {
          std::swap(at[i], at[inside]);
          ++swaps;
        }
        ++inside;
      }
    }
    if (inside == 0 || inside == 4) return;
    const bool flip = swaps % 2;
    const auto [a, b, c, d] = at;
    if (inside == 1) {
      triangle(edge(a, b), edge(a, c), edge(a, d), flip);
    } else if (inside == 3) {
      triangle(edge(a, d), edge(b, d), edge(c, d), flip);
    } else {
      const std::uint32_t ac = edge(a, c), ad = edge(a, d), bc = edge(b, c), bd = edge(b, d);
      triangle(ac, ad, bc, flip);
      triangle(bc, ad, bd, flip);
    }
  }

  std::uint32_t edge(std::size_t a, std::size_t b) {
    if (a > b) std::swap(a, b);
    const std::uint64_t key = static_cast<std::uint64_t>(a) << 32 | b;
    const auto [it, fresh] =
        vertices_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (fresh) {
      const float va = values_[a], vb = values_[b];
      const float s = std::clamp(va / (va - vb), 0.001f, 0.999f);
      mesh_.vertices.push_back(glm::mix(grid_.position(a), grid_.position(b), s));
    }
    return it->second;
  }

  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool flip) {
    if (flip) std::swap(b, c);
    mesh_.triangles.insert(mesh_.triangles.end(), {a, b, c});
  }

  const Grid& grid_;
  const std::vector<float>& values_;
  TriangleMesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertices_;
};

}  // namespace

TriangleMesh polygonise(const std::function<float(const Vec3f&)>& value, const Vec3f& min,
                        const Vec3f& max, float step) {
  Grid grid{min, step, {}};
  for (int i = 0; i < 3; ++i)
    grid.size[i] = static_cast<int>(std::ceil((max[i] - min[i]) / step)) + 1;
  const std::vector<float> values = sample(value, grid);
  for (int z = 0; z < grid.size[2]; ++z) {
    for (int y = 0; y < grid.size[1]; ++y) {
      for (int x = 0; x < grid.size[0]; ++x) {
        const bool rim = x == 0 || y == 0 || z == 0 || x == grid.size[0] - 1 ||
                         y == grid.size[1] - 1 || z == grid.size[2] - 1;
        if (rim && values[grid.index(x, y, z)] < 0.0f) {
          throw Error(
              Error::Kind::bad_input,
              "A level cannot be polygonised: it touches the rim of its grid; give a larger box.");
        }
      }
    }
  }
  Marcher marcher(grid, values);
  for (int z = 0; z + 1 < grid.size[2]; ++z) {
    for (int y = 0; y + 1 < grid.size[1]; ++y)
      for (int x = 0; x + 1 < grid.size[0]; ++x) marcher.cube(x, y, z);
  }
  return marcher.take();
}

void relax(TriangleMesh& mesh, const std::function<float(const Vec3f&)>& value,
           const std::function<Vec3f(const Vec3f&)>& gradient, int passes) {
  std::vector<Vec3f> sums(mesh.vertices.size());
  std::vector<float> counts(mesh.vertices.size());
  for (int pass = 0; pass < passes; ++pass) {
    std::fill(sums.begin(), sums.end(), Vec3f(0.0f));
    std::fill(counts.begin(), counts.end(), 0.0f);
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) {
      for (int i = 0; i < 3; ++i) {
        // Each edge is met in both directions, once per triangle: one of the two ends is enough.
        const std::uint32_t from = mesh.triangles[t + i], to = mesh.triangles[t + (i + 1) % 3];
        sums[from] += mesh.vertices[to];
        counts[from] += 1.0f;
      }
    }
    parallel_each(mesh.vertices.size(), 512, 0, [&](std::size_t i) {
      Vec3f p = sums[i] / counts[i];
      for (int step = 0; step < (pass + 1 == passes ? 3 : 1); ++step) {
        const Vec3f g = gradient(p);
        p -= g * (value(p) / std::max(glm::dot(g, g), 0.1f));
      }
      mesh.vertices[i] = p;
    });
  }
}

ManifoldDefects manifold_defects(const std::vector<std::uint32_t>& triangles,
                                 std::size_t vertex_count) {
  ManifoldDefects defects;
  std::unordered_map<std::uint64_t, std::uint32_t> directed;  // edge -> opposite corner
  std::vector<std::uint32_t> fan(vertex_count, 0);            // triangles at each vertex
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint64_t>(a) << 32 | b;
  };
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const std::uint32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    if (a == b || b == c || c == a) {
      ++defects.empty_triangles;
      continue;
    }
    for (const auto& [from, to, third] : {std::array{a, b, c}, {b, c, a}, {c, a, b}}) {
      ++fan[from];
      if (!directed.try_emplace(key(from, to), third).second) ++defects.crowded_edges;
    }
  }
  for (const auto& [edge, third] : directed) {
    const auto from = static_cast<std::uint32_t>(edge >> 32), to = static_cast<std::uint32_t>(edge);
    if (!directed.contains(key(to, from))) ++defects.open_edges;
    if (fan[from] == 0) continue;
    // Walk once around the vertex; a single ring uses up all its triangles.
    std::uint32_t steps = 0;
    std::uint32_t rim = to;
    do {
      const auto next = directed.find(key(from, rim));
      if (next == directed.end()) break;
      rim = next->second;
      ++steps;
    } while (rim != to && steps <= fan[from]);
    if (steps != fan[from]) ++defects.pinched_vertices;
    fan[from] = 0;
  }
  return defects;
}

}  // namespace polyhull
