// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/weld.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace polyhull {
namespace {

// Cells as wide as the distance: near vertices lie in the same or a neighbouring one.
class Grid {
 public:
  explicit Grid(double width) : width_(width) {}

  // The index of a kept vertex within the distance, or that of `vertex` itself, kept from now on.
  std::uint32_t keep(const Vec3f& vertex, std::vector<Vec3f>& kept) {
    const auto cell = [&](float x) {
      return static_cast<std::int64_t>(std::clamp(std::floor(x / width_), -9e17, 9e17));
    };
    const std::int64_t x = cell(vertex.x), y = cell(vertex.y), z = cell(vertex.z);
    std::uint32_t best = ~0u;
    for (std::int64_t i = x - 1; i <= x + 1; ++i)
      for (std::int64_t j = y - 1; j <= y + 1; ++j)
        for (std::int64_t k = z - 1; k <= z + 1; ++k) {
          const auto [begin, end] = cells_.equal_range(key(i, j, k));
          for (auto found = begin; found != end; ++found)
            if (found->second < best &&
                glm::length(Vec3(kept[found->second]) - Vec3(vertex)) <= width_)
              best = found->second;
        }
    if (best != ~0u) return best;
    const auto index = static_cast<std::uint32_t>(kept.size());
    kept.push_back(vertex);
    cells_.emplace(key(x, y, z), index);
    return index;
  }

 private:
  static std::uint64_t key(std::int64_t i, std::int64_t j, std::int64_t k) {
    return static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15u ^
           static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4Fu ^
           static_cast<std::uint64_t>(k) * 0x165667B19E3779F9u;
  }

  double width_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> cells_;
};

void weld_triangles(Hull& hull, const std::vector<std::uint32_t>& place) {
  std::vector<std::uint32_t> triangles;
  triangles.reserve(hull.triangles.size());
  for (HullFace& face : hull.faces) {
    const std::size_t first = triangles.size() / 3;
    for (std::uint32_t i = 0; i < face.triangle_count; ++i) {
      const std::uint32_t* corner = &hull.triangles[3 * (face.first_triangle + i)];
      const std::uint32_t a = place[corner[0]], b = place[corner[1]], c = place[corner[2]];
      if (a != b && b != c && c != a) triangles.insert(triangles.end(), {a, b, c});
    }
    face.first_triangle = static_cast<std::uint32_t>(first);
    face.triangle_count = static_cast<std::uint32_t>(triangles.size() / 3 - first);
  }
  hull.triangles = std::move(triangles);
}

void weld_loops(Hull& hull, const std::vector<std::uint32_t>& place) {
  std::vector<std::uint32_t> vertices, loop_ends, face_loop_ends;
  std::size_t loop = 0, at = 0;
  for (const std::uint32_t face_end : hull.face_loop_ends) {
    for (; loop < face_end; ++loop) {
      const std::size_t begin = vertices.size();
      for (; at < hull.loop_ends[loop]; ++at) {
        const std::uint32_t vertex = place[hull.loop_vertices[at]];
        if (vertices.size() == begin || vertices.back() != vertex) vertices.push_back(vertex);
      }
      while (vertices.size() > begin + 1 && vertices.back() == vertices[begin]) vertices.pop_back();
      if (vertices.size() < begin + 3)
        vertices.resize(begin);
      else
        loop_ends.push_back(static_cast<std::uint32_t>(vertices.size()));
    }
    face_loop_ends.push_back(static_cast<std::uint32_t>(loop_ends.size()));
  }
  hull.loop_vertices = std::move(vertices);
  hull.loop_ends = std::move(loop_ends);
  hull.face_loop_ends = std::move(face_loop_ends);
}

}  // namespace

void weld_vertices(Hull& hull, double distance) {
  if (!(distance > 0.0) || hull.vertices.empty()) return;
  Grid grid(distance);
  std::vector<Vec3f> kept;
  std::vector<std::uint32_t> place;
  place.reserve(hull.vertices.size());
  for (const Vec3f& vertex : hull.vertices) place.push_back(grid.keep(vertex, kept));
  hull.vertices = std::move(kept);
  weld_triangles(hull, place);
  weld_loops(hull, place);
}

}  // namespace polyhull
