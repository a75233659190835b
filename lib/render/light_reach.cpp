// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/light_reach.h"

#include <algorithm>
#include <cmath>

#include "raytrace/sampling.h"
#include "render/light_samples.h"

namespace polyhull {
namespace {

constexpr int texels = LightReach::texels;
constexpr float least_depth = 1e-3f;

int row_of(float y) {
  return std::clamp(static_cast<int>(y), 0, texels - 1);
}

/// What a triangle touches of a row of texels.
struct Columns {
  float left = texels, right = 0.0f;
  void add(float a, float b) {
    left = std::min(left, std::min(a, b));
    right = std::max(right, std::max(a, b));
  }
};

/// Adds what an edge touches of each row.
void add_edge(const Vec2f& a, const Vec2f& b, Columns (&rows)[texels]) {
  const Vec2f &upper = a.y < b.y ? a : b, &lower = a.y < b.y ? b : a;
  const int first = row_of(upper.y), last = row_of(lower.y);
  const float slope = (lower.x - upper.x) / std::max(lower.y - upper.y, 1e-30f);
  float x = upper.x;
  for (int row = first; row < last; ++row) {
    const float next = upper.x + (static_cast<float>(row + 1) - upper.y) * slope;
    rows[row].add(x, next);
    x = next;
  }
  rows[last].add(x, lower.x);
}

/// Fills what a triangle touches, row by row: its edges' extents between two rows are its own. Of one
/// that lies in two rows or fewer the whole box.
void fill(const Vec2f& a, const Vec2f& b, const Vec2f& c, Columns (&rows)[texels],
          std::vector<int>& filled) {
  const int first = row_of(std::min({a.y, b.y, c.y})), last = row_of(std::max({a.y, b.y, c.y}));
  const bool small = last - first < 2;
  Columns box;
  if (small) {
    box.add(a.x, b.x);
    box.add(c.x, c.x);
  } else {
    std::fill(rows + first, rows + last + 1, Columns{});
    add_edge(a, b, rows);
    add_edge(b, c, rows);
    add_edge(c, a, rows);
  }
  for (int row = first; row <= last; ++row) {
    const Columns& columns = small ? box : rows[row];
    // A hundredth of a texel more than rounding could take away.
    const int from = std::clamp(static_cast<int>(columns.left - 0.01f), 0, texels - 1);
    const int to = std::clamp(static_cast<int>(columns.right + 0.01f), 0, texels - 1);
    for (int x = from; x <= to; ++x) filled[static_cast<std::size_t>(row) * texels + x] = 1;
  }
}

}  // namespace

bool LightReach::build(const Light& light, std::span<const Vec3f> points,
                       std::span<const std::uint32_t> triangles) {
  const Vec3f centre_before = map_.centre, forward_before = map_.forward;
  map_.centre = light.centre;
  map_.nearest = 0.0f;
  map_.everywhere = false;
  map_.point = !light.is_area();
  if (!map_.point) {
    map_.forward = light_normal(light);
  } else {
    Vec3f middle(0.0f);
    for (const Vec3f& p : points) middle += p / static_cast<float>(points.size());
    const Vec3f way = middle - map_.centre;
    map_.forward = glm::length(way) > 0.0f ? glm::normalize(way) : Vec3f(0, -1, 0);
  }
  const bool other = map_.centre != centre_before || map_.forward != forward_before;
  const auto [right, down] = tangents(map_.forward);
  map_.right = right;
  map_.down = down;
  map_.extent = {std::abs(glm::dot(light.u, map_.right)) + std::abs(glm::dot(light.v, map_.right)),
                 std::abs(glm::dot(light.u, map_.down)) + std::abs(glm::dot(light.v, map_.down))};

  std::vector<Vec2f> map(points.size());
  map_.low = Vec2f(1e30f);
  Vec2f high(-1e30f);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f d = points[i] - map_.centre;
    const float z = glm::dot(d, map_.forward);
    if (!(z > least_depth)) {
      map_.everywhere = true;
      return other;
    }
    map[i] = Vec2f(glm::dot(d, map_.right), glm::dot(d, map_.down)) / z;
    map_.low = glm::min(map_.low, map[i]);
    high = glm::max(high, map[i]);
    map_.nearest = std::max(map_.nearest, 1.0f / z);
  }
  map_.scale = static_cast<float>(texels) / glm::max(high - map_.low, Vec2f(1e-6f));
  std::vector<int> filled(static_cast<std::size_t>(texels) * texels, 0);
  for (Vec2f& place : map) place = (place - map_.low) * map_.scale;
  Columns rows[texels];
  for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
    fill(map[triangles[i]], map[triangles[i + 1]], map[triangles[i + 2]], rows, filled);
  constexpr std::size_t stride = texels + 1;
  sums_.assign(stride * stride, 0);
  for (std::size_t y = 0; y < texels; ++y) {
    int row = 0;
    for (std::size_t x = 0; x < texels; ++x) {
      row += filled[y * texels + x];
      sums_[(y + 1) * stride + x + 1] = sums_[y * stride + x + 1] + row;
    }
  }
  return other;
}

LightReach::Place LightReach::place(const Vec3f& point) const {
  const Vec3f d = point - map_.centre;
  const float z = glm::dot(d, map_.forward);
  if (!(z > least_depth)) return {};  // behind the light, or in its plane
  const float inverse = 1.0f / z;
  return {Vec2f(glm::dot(d, map_.right), glm::dot(d, map_.down)) * inverse, inverse};
}

void LightReach::Extent::add(const Place& place) {
  if (place.inverse == 0.0f) return;
  low = glm::min(low, place.tangents);
  high = glm::max(high, place.tangents);
  least = std::min(least, place.inverse);
  most = std::max(most, place.inverse);
}

bool LightReach::may_shade(const Extent& places) const {
  if (map_.everywhere && map_.point) return true;  // behind its plane, too
  return !places.empty() && (map_.everywhere || any_between(places.low, places.high, places.least));
}

bool LightReach::may_shade(const Place& place) const {
  if (map_.everywhere && map_.point) return true;
  return place.inverse > 0.0f &&
         (map_.everywhere || any_between(place.tangents, place.tangents, place.inverse));
}

bool LightReach::must_shade(const Extent& places) const {
  // What lies around each of them, if only as far as around the one nearest to the light.
  return !map_.everywhere && !places.empty() && any_between(places.high, places.low, places.most);
}

/// Whether any texel is filled from what lies around \p low up to what lies around \p high, as far as
/// depth 1 / \p inverse asks for.
bool LightReach::any_between(const Vec2f& low, const Vec2f& high, float inverse) const {
  const float reach = map_.nearest - inverse;
  if (!(reach > 0.0f)) return false;  // nearer to the light than all subjects
  const Vec2f around = map_.extent * reach;
  // A texel more: places are known as well as depth is, and rays start a little beside them.
  const Vec2f first = (low - around - map_.low) * map_.scale - 1.0f;
  const Vec2f last = (high + around - map_.low) * map_.scale + 1.0f;
  if (!(last.x >= 0.0f && last.y >= 0.0f && first.x <= texels && first.y <= texels)) return false;
  if (first.x > last.x || first.y > last.y) return false;
  const auto whole = [](float value) {
    return static_cast<int>(std::clamp(value, 0.0f, static_cast<float>(texels)));
  };
  const int x0 = whole(first.x), x1 = whole(last.x + 1.0f);
  constexpr std::ptrdiff_t stride = texels + 1;
  const int* top = sums_.data() + whole(first.y) * stride;
  const int* bottom = sums_.data() + whole(last.y + 1.0f) * stride;
  return bottom[x1] - top[x1] - bottom[x0] + top[x0] > 0;
}

}  // namespace polyhull
