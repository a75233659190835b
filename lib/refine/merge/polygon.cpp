// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/polygon.h"

#include <algorithm>
#include <cmath>

namespace polyhull::refine {
namespace {

constexpr std::size_t most_corners = 24;
/// Cosine of a triangle's normal and the polygon's.
constexpr float least_facing = 0.1f;
/// What the square of a triangle's longest side counts, beside its area.
constexpr float slender = 0.05f;
constexpr float no_way = 1e30f;

struct Cuts {
  float least[most_corners][most_corners];
  std::uint8_t by[most_corners][most_corners];

  void take(std::span<const PolygonCorner> corners, std::size_t i, std::size_t j,
            std::vector<std::uint32_t>& triangles) const {
    if (j - i < 2) return;
    const std::size_t k = by[i][j];
    triangles.insert(triangles.end(), {corners[i].vertex, corners[k].vertex, corners[j].vertex});
    take(corners, i, k, triangles);
    take(corners, k, j, triangles);
  }
};

/// Of the triangle i, k, j.
float cost(const Vec3f& i, const Vec3f& k, const Vec3f& j, const Vec3f& normal) {
  const Vec3f area = glm::cross(k - i, j - i);
  const float size = glm::length(area);
  if (!(glm::dot(area, normal) > least_facing * size)) return no_way;
  const float longest =
      std::max({glm::dot(k - i, k - i), glm::dot(j - k, j - k), glm::dot(j - i, j - i)});
  return size + slender * longest;
}

}  // namespace

bool faces(const Vec3f& a, const Vec3f& b, const Vec3f& c, const Vec3f& normal) {
  const Vec3f area = glm::cross(b - a, c - a);
  return glm::dot(area, normal) > least_facing * glm::length(area) * glm::length(normal);
}

bool cut_polygon(std::span<const PolygonCorner> corners, const Vec3f& normal,
                 std::vector<std::uint32_t>& triangles) {
  const std::size_t n = corners.size();
  if (n < 3 || n > most_corners) return false;
  Cuts cuts;
  for (std::size_t i = 0; i + 1 < n; ++i) cuts.least[i][i + 1] = 0.0f;
  for (std::size_t span = 2; span < n; ++span)
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t j = i + span;
      const bool whole = span == n - 1;
      float least = no_way;
      if (whole || (corners[i].faces & corners[j].faces) == 0)
        for (std::size_t k = i + 1; k < j; ++k) {
          const float parts = cuts.least[i][k] + cuts.least[k][j];
          if (!(parts < least)) continue;
          const float sum =
              parts + cost(corners[i].point, corners[k].point, corners[j].point, normal);
          if (sum < least) least = sum, cuts.by[i][j] = static_cast<std::uint8_t>(k);
        }
      if (!whole && least < no_way) {
        const Vec3f chord = corners[j].point - corners[i].point;
        least += glm::length(chord) * (std::abs(glm::dot(chord, corners[i].normal)) +
                                       std::abs(glm::dot(chord, corners[j].normal)));
      }
      cuts.least[i][j] = least;
    }
  if (!(cuts.least[0][n - 1] < no_way)) return false;
  cuts.take(corners, 0, n - 1, triangles);
  return true;
}

}  // namespace polyhull::refine
