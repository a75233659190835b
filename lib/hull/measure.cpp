// SPDX-License-Identifier: LGPL-2.1-or-later
#include "hull/measure.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace polyhull {

bool is_closed(const Hull& hull) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(hull.triangles.size());
  for (std::size_t t = 0; t + 2 < hull.triangles.size(); t += 3)
    for (int k = 0; k < 3; ++k)
      edges.emplace_back(hull.triangles[t + k], hull.triangles[t + (k + 1) % 3]);
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    return edge.first != edge.second &&
           std::binary_search(edges.begin(), edges.end(), std::pair(edge.second, edge.first));
  });
}

double enclosed_volume(const Hull& hull) {
  double volume = 0.0;
  for (std::size_t t = 0; t + 2 < hull.triangles.size(); t += 3) {
    const Vec3 a(hull.vertices[hull.triangles[t]]), b(hull.vertices[hull.triangles[t + 1]]),
        c(hull.vertices[hull.triangles[t + 2]]);
    volume += glm::dot(a, glm::cross(b, c)) / 6.0;
  }
  return volume;
}

std::vector<std::uint32_t> connected_parts(const Hull& hull) {
  std::vector<std::uint32_t> root(hull.vertices.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    root[std::max(a, b)] = std::min(a, b);
  };
  for (std::size_t i = 0; i + 2 < hull.triangles.size(); i += 3) {
    join(hull.triangles[i], hull.triangles[i + 1]);
    join(hull.triangles[i], hull.triangles[i + 2]);
  }
  for (std::uint32_t v = 0; v < root.size(); ++v) root[v] = find(v);
  return root;
}

double sliver_share(const Hull& hull) {
  std::size_t slivers = 0;
  for (std::size_t t = 0; t + 2 < hull.triangles.size(); t += 3) {
    const Vec3 a(hull.vertices[hull.triangles[t]]), b(hull.vertices[hull.triangles[t + 1]]),
        c(hull.vertices[hull.triangles[t + 2]]);
    const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
    // Twice the area is height times longest edge.
    if (!(glm::length(glm::cross(b - a, c - a)) >= 2e-3 * longest * longest)) ++slivers;
  }
  return hull.triangles.empty() ? 0.0 : double(slivers) * 3.0 / double(hull.triangles.size());
}

}  // namespace polyhull
