// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/field/silhouette_map.h"

#include <algorithm>
#include <cmath>

namespace polyhull::refine {
namespace {

float square_distance(const SilhouetteMapper::Segment& segment, float u, float v) {
  const float x = u - segment.begin.x, y = v - segment.begin.y;
  const float along = (x * segment.way.x + y * segment.way.y) * segment.by_square;
  const float t = std::clamp(along, 0.0f, 1.0f);
  const float dx = x - t * segment.way.x, dy = y - t * segment.way.y;
  return dx * dx + dy * dy;
}

}  // namespace

/// Exact distances on the texels within reach of each segment: row by row, since a long slanted
/// segment's box is mostly far from it.
void SilhouetteMapper::seed(const SilhouetteMap& map, int reach, bool with_nearest) {
  const float by_texel = 1.0f / map.texel;
  const auto near = static_cast<float>(reach);
  for (std::size_t k = 0; k < segments.size(); ++k) {
    const Segment& s = segments[k];
    const Vec2f a = (s.begin - Vec2f(map.left, map.top)) * by_texel, way = s.way * by_texel;
    const float low = std::min(a.y, a.y + way.y), high = std::max(a.y, a.y + way.y);
    const int first = std::max(0, static_cast<int>(std::floor(low)) - reach + 1);
    const int last = std::min(map.height - 1, static_cast<int>(std::ceil(high)) + reach - 1);
    const bool steep = std::abs(way.y) > 0.02f * std::abs(way.x);
    for (int y = first; y <= last; ++y) {
      float from = 0.0f, to = 1.0f;  // the part of the segment within reach of this row
      if (steep) {
        from = std::clamp((static_cast<float>(y) - near - a.y) / way.y, 0.0f, 1.0f);
        to = std::clamp((static_cast<float>(y) + near - a.y) / way.y, 0.0f, 1.0f);
      }
      const float p = a.x + from * way.x, q = a.x + to * way.x;
      const int left = std::max(0, static_cast<int>(std::floor(std::min(p, q))) - reach + 1);
      const int right =
          std::min(map.width - 1, static_cast<int>(std::ceil(std::max(p, q))) + reach - 1);
      const float v = map.top + static_cast<float>(y) * map.texel;
      const std::size_t row = static_cast<std::size_t>(y) * map.width;
      if (!with_nearest) {
        float* __restrict squares = square.data() + row;
        for (int x = left; x <= right; ++x)
          squares[x] = std::min(
              squares[x], square_distance(s, map.left + static_cast<float>(x) * map.texel, v));
        continue;
      }
      for (int x = left; x <= right; ++x) {
        const float d = square_distance(s, map.left + static_cast<float>(x) * map.texel, v);
        if (d < square[row + x]) {
          square[row + x] = d;
          nearest[row + x] = static_cast<int>(k);
        }
      }
    }
  }
}

void SilhouetteMapper::sweep(const SilhouetteMap& map) {
  const int width = map.width, height = map.height;
  const auto ask = [&](std::size_t at, std::size_t neighbour, float u, float v) {
    const int k = nearest[neighbour];
    if (k < 0 || k == nearest[at]) return;
    const float d = square_distance(segments[static_cast<std::size_t>(k)], u, v);
    if (d < square[at]) {
      square[at] = d;
      nearest[at] = k;
    }
  };
  const auto row_from = [&](int y, int other) {
    const float v = map.top + static_cast<float>(y) * map.texel;
    const std::size_t row = static_cast<std::size_t>(y) * width;
    const bool has_other = other >= 0 && other < height;
    const std::size_t above = has_other ? static_cast<std::size_t>(other) * width : 0;
    for (int x = 0; x < width; ++x) {
      const float u = map.left + static_cast<float>(x) * map.texel;
      if (x > 0) ask(row + x, row + x - 1, u, v);
      if (!has_other) continue;
      ask(row + x, above + x, u, v);
      if (x > 0) ask(row + x, above + x - 1, u, v);
      if (x + 1 < width) ask(row + x, above + x + 1, u, v);
    }
    for (int x = width - 2; x >= 0; --x)
      ask(row + x, row + x + 1, map.left + static_cast<float>(x) * map.texel, v);
  };
  for (int y = 0; y < height; ++y) row_from(y, y - 1);
  for (int y = height - 1; y >= 0; --y) row_from(y, y + 1);
}

/// From squares to distances of at most \p most, with their signs: inside by the even-odd rule.
void SilhouetteMapper::finish(SilhouetteMap& map, float most) {
  crossings.resize(std::max(crossings.size(), static_cast<std::size_t>(map.height)));
  for (int y = 0; y < map.height; ++y) crossings[y].clear();
  for (const Segment& s : segments) {
    if (s.way.y == 0.0f) continue;
    const Vec2f a = s.way.y > 0.0f ? s.begin : s.begin + s.way,
                way = s.way.y > 0.0f ? s.way : -s.way;
    const float slope = way.x / way.y, end = a.y + way.y;
    int y = std::max(0, static_cast<int>(std::ceil((a.y - map.top) / map.texel)));
    for (; y < map.height; ++y) {
      const float v = map.top + static_cast<float>(y) * map.texel;
      if (v >= end) break;
      if (v >= a.y) crossings[y].push_back(a.x + (v - a.y) * slope);
    }
  }
  for (int y = 0; y < map.height; ++y) {
    std::vector<float>& crossed = crossings[y];
    std::sort(crossed.begin(), crossed.end());
    const std::size_t row = static_cast<std::size_t>(y) * map.width;
    const float* __restrict squares = square.data() + row;
    float* __restrict out = map.distance.data() + row;
    for (int x = 0; x < map.width; ++x) out[x] = -std::min(most, std::sqrt(squares[x]));
    std::size_t passed = 0;
    for (int x = 0; x < map.width && passed < crossed.size(); ++x) {
      const float u = map.left + static_cast<float>(x) * map.texel;
      while (passed < crossed.size() && crossed[passed] < u) ++passed;
      if (passed % 2 == 1) out[x] = -out[x];
    }
  }
}

void SilhouetteMapper::draw(SilhouetteMap& map, const Rings& rings, const MapDrawing& how,
                            const PictureBox& within) {
  constexpr float most_texels = 4096.0f;
  map.width = map.height = 0;
  map.distance.clear();
  segments.clear();
  Vec2f low(1e30f), high(-1e30f);
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const std::span<const Vec2f> ring = rings.ring(r);
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2f way = ring[i + 1 == ring.size() ? 0 : i + 1] - ring[i];
      segments.push_back({ring[i], way, 1.0f / std::max(1e-12f, glm::dot(way, way))});
      low = glm::min(low, ring[i]);
      high = glm::max(high, ring[i]);
    }
  }
  low = glm::max(low - how.margin, within.low);
  high = glm::min(high + how.margin, within.high);
  if (segments.empty() || !(low.x < high.x) || !(low.y < high.y)) return;
  const Vec2f size = high - low;
  map.texel = std::max(how.texel, std::max(size.x, size.y) / most_texels);
  map.left = std::floor(low.x);
  map.top = std::floor(low.y);
  map.width = static_cast<int>(std::ceil((high.x - map.left) / map.texel)) + 2;
  map.height = static_cast<int>(std::ceil((high.y - map.top) / map.texel)) + 2;
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  if (how.everywhere) nearest.assign(texels, -1);
  square.assign(texels, 1e12f);
  map.distance.resize(texels);
  seed(map, how.reach, how.everywhere);
  if (how.everywhere) sweep(map);
  finish(map, how.everywhere ? 1e6f : static_cast<float>(how.reach) * map.texel);
}

}  // namespace polyhull::refine
