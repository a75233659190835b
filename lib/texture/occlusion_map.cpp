// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/occlusion_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace polyhull {
namespace {

// Distances are in tenths of a texel, with chamfer steps of 1 and 1.4: all that counts are those up
// to the fade's end.
constexpr int straight = 10, diagonal = 14, far_away = 1 << 20;

/// Lowers \p row to what \p other, the row beside it, allows, from x - 1 to x + 1.
void lower_from_beside(const int* other, int* row, int width) {
  row[0] = std::min({row[0], other[0] + straight, other[std::min(1, width - 1)] + diagonal});
  for (int x = 1; x < width - 1; ++x)
    row[x] = std::min(std::min(row[x], other[x] + straight),
                      std::min(other[x - 1], other[x + 1]) + diagonal);
  const int end = width - 1;
  row[end] = std::min({row[end], other[end] + straight, other[std::max(end - 1, 0)] + diagonal});
}

/// Distance to the nearest texel that is 0 in \p distance.
void chamfer(std::vector<int>& distance, int width, int height) {
  const auto row_of = [&](int y) { return distance.data() + static_cast<std::size_t>(y) * width; };
  for (int y = 0; y < height; ++y) {
    int* row = row_of(y);
    if (y > 0) lower_from_beside(row_of(y - 1), row, width);
    for (int x = 0, least = far_away; x < width; ++x)
      row[x] = least = std::min(least + straight, row[x]);
  }
  for (int y = height - 1; y >= 0; --y) {
    int* row = row_of(y);
    if (y + 1 < height) lower_from_beside(row_of(y + 1), row, width);
    for (int x = width - 1, least = far_away; x >= 0; --x)
      row[x] = least = std::min(least + straight, row[x]);
  }
}

/// 0 on texels without surface or beside a jump in depth, far away elsewhere.
std::vector<int> mark_jumps(const std::vector<float>& depth, int width, int height,
                            float texel_per_depth) {
  // A surface seen at more than about 80 degrees rises this many texels from one texel to the next.
  // Beside no surface (depth 0) everything is a jump.
  constexpr float steepest = 6.0f;
  const float most = steepest * texel_per_depth;
  const auto jump = [most](float p, float q) -> int {
    return std::abs(p - q) > most * std::min(p, q);
  };
  std::vector<int> distance(depth.size());
  // Whether there is a jump before a texel of this row, and above and below it.
  std::vector<int> before(width + 1, 0), above(width, 0), below(width, 0);
  for (int y = 0; y < height; ++y) {
    const float* row = depth.data() + static_cast<std::size_t>(y) * width;
    for (int x = 1; x < width; ++x) before[x] = jump(row[x - 1], row[x]);
    if (y + 1 < height)
      for (int x = 0; x < width; ++x) below[x] = jump(row[x], row[x + width]);
    else
      std::fill(below.begin(), below.end(), 0);
    int* out = distance.data() + static_cast<std::size_t>(y) * width;
    for (int x = 0; x < width; ++x) {
      const int any = (row[x] == 0.0f) | before[x] | before[x + 1] | above[x] | below[x];
      out[x] = any ? 0 : far_away;
    }
    std::swap(above, below);
  }
  return distance;
}

/// The largest of a texel and those around it.
std::vector<float> largest_around(const std::vector<float>& values, int width, int height) {
  std::vector<float> wide(values.size()), out(values.size());
  for (int y = 0; y < height; ++y) {
    const float* row = values.data() + static_cast<std::size_t>(y) * width;
    float* to = wide.data() + static_cast<std::size_t>(y) * width;
    to[0] = std::max(row[0], row[std::min(1, width - 1)]);
    for (int x = 1; x < width - 1; ++x) to[x] = std::max(std::max(row[x - 1], row[x]), row[x + 1]);
    to[width - 1] = std::max(row[width - 1], row[std::max(width - 2, 0)]);
  }
  for (int y = 0; y < height; ++y) {
    const float* row = wide.data() + static_cast<std::size_t>(y) * width;
    const float* up = y > 0 ? row - width : row;
    const float* down = y + 1 < height ? row + width : row;
    float* to = out.data() + static_cast<std::size_t>(y) * width;
    for (int x = 0; x < width; ++x) to[x] = std::max(std::max(up[x], row[x]), down[x]);
  }
  return out;
}

/// 0 on texels outside the camera's frame, which hold no pixels.
void mark_frame(std::vector<int>& distance, const OcclusionMap& map, const Camera& camera) {
  if (!leaves_frame(map, camera)) return;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x)
      if (!in_frame(camera, {map.x + x * map.step, map.y + y * map.step}, 0.0))
        distance[static_cast<std::size_t>(y) * map.width + x] = 0;
  }
}

}  // namespace

bool in_frame(const Camera& camera, const Vec2& ideal, double margin) {
  const Vec2 real = camera.has_distortion() ? camera.distort(ideal) : ideal;
  return real.x >= -margin && real.y >= -margin && real.x <= camera.width - 1.0 + margin &&
         real.y <= camera.height - 1.0 + margin;
}

bool leaves_frame(const OcclusionMap& map, const Camera& camera) {
  const auto outside = [&](int x, int y) {
    return !in_frame(camera, {map.x + x * map.step, map.y + y * map.step}, 0.0);
  };
  for (int x = 0; x < map.width; ++x)
    if (outside(x, 0) || outside(x, map.height - 1)) return true;
  for (int y = 0; y < map.height; ++y)
    if (outside(0, y) || outside(map.width - 1, y)) return true;
  return false;
}

OcclusionMap lay_out_map(const PictureBounds& bounds, const Camera& camera, int size) {
  OcclusionMap map;
  if (!(bounds.high_x >= bounds.low_x)) return map;
  // What lies far outside the frame has no pixels to fade. What reaches behind the camera may lie
  // anywhere in the picture.
  const float left = -0.5f * static_cast<float>(camera.width);
  const float top = -0.5f * static_cast<float>(camera.height);
  const float right = 1.5f * static_cast<float>(camera.width);
  const float bottom = 1.5f * static_cast<float>(camera.height);
  const float low_x = bounds.behind ? left : std::max(bounds.low_x, left);
  const float low_y = bounds.behind ? top : std::max(bounds.low_y, top);
  const float high_x = bounds.behind ? right : std::min(bounds.high_x, right);
  const float high_y = bounds.behind ? bottom : std::min(bounds.high_y, bottom);
  if (!(high_x >= low_x) || !(high_y >= low_y)) return map;

  constexpr int border = 2;  // empty texels all around, so that clamped look-ups find fade 0
  const int inner = std::max(size, 8) - 2 * border - 1;
  map.step = std::max(std::max(high_x - low_x, high_y - low_y) / static_cast<float>(inner), 0.5f);
  map.x = low_x - border * map.step;
  map.y = low_y - border * map.step;
  map.width = static_cast<int>(std::ceil((high_x - low_x) / map.step)) + 2 * border + 1;
  map.height = static_cast<int>(std::ceil((high_y - low_y) / map.step)) + 2 * border + 1;
  map.near = 1.0f / bounds.nearest;
  map.far =
      std::max(1.0f / bounds.farthest, std::nextafter(map.near, std::numeric_limits<float>::max()));
  return map;
}

void finish_map(const DepthGrid& grid, int finer, const Camera& camera, double fade_width,
                OcclusionMap& map) {
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  std::vector<float> surface(texels);
  for (int y = 0; y < map.height; ++y) {
    const float* row = grid.inverse + static_cast<std::size_t>(y) * finer * grid.stride;
    float* to = surface.data() + static_cast<std::size_t>(y) * map.width;
    for (int x = 0; x < map.width; ++x) {
      const float inverse = row[x * finer];
      to[x] = inverse > 0.0f ? 1.0f / inverse : 0.0f;
    }
  }

  const auto texel_per_depth = map.step / static_cast<float>(camera.K[0][0]);
  std::vector<int> distance = mark_jumps(surface, map.width, map.height, texel_per_depth);
  mark_frame(distance, map, camera);
  chamfer(distance, map.width, map.height);
  // The margin covers the soft edge of a matte and the reach of a bilinear look-up.
  const float margin = std::max(1.5f / map.step, 1.0f);
  const float ramp = std::max(static_cast<float>(fade_width) / map.step, 1.0f);
  map.fade.resize(texels);
  // Bytes may be anything, the vectors' pointers too; and clamp() would branch.
  std::uint8_t* const fade_of = map.fade.data();
  const int* const distance_of = distance.data();
  for (std::size_t p = 0; p < texels; ++p) {
    const float texels_away = static_cast<float>(distance_of[p]) / straight;
    const float fade = std::min(std::max((texels_away - margin) / ramp, 0.0f), 1.0f);
    fade_of[p] = static_cast<std::uint8_t>(255.0f * fade + 0.5f);
  }

  // The farthest of the neighbours: a slanted surface then never hides itself, and where a jump
  // makes this wrong the fade is 0.
  const std::vector<float> farthest = largest_around(surface, map.width, map.height);
  const float scale = 65534.0f / (map.far - map.near);
  map.depth.resize(texels);
  const float near = map.near;
  for (std::size_t p = 0; p < texels; ++p) {
    const float above = std::min(std::max((farthest[p] - near) * scale, 0.0f), 65534.0f);
    const int depth = static_cast<int>(above);
    map.depth[p] = static_cast<std::uint16_t>(farthest[p] == 0.0f ? 65535 : depth);
  }
}

}  // namespace polyhull
