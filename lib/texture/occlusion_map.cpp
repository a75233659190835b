// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/occlusion_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace polyhull {
namespace {

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
                OcclusionMap& map, const TextureLoops& loops) {
  // Kept, so that it is neither cleared nor asked for anew: all of it is written.
  struct Memory {
    std::vector<float> surface, wide;
    std::vector<int> distance;
  };
  thread_local Memory memory;
  auto& [surface, wide, distance] = memory;
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  for (auto* numbers : {&surface, &wide}) numbers->resize(texels);
  distance.resize(texels);
  for (int y = 0; y < map.height; ++y) {
    const float* row = grid.inverse + static_cast<std::size_t>(y) * finer * grid.stride;
    float* to = surface.data() + static_cast<std::size_t>(y) * map.width;
    for (int x = 0; x < map.width; ++x) {
      const float inverse = row[x * finer];
      to[x] = inverse > 0.0f ? 1.0f / inverse : 0.0f;
    }
  }

  // A surface seen at more than about 80 degrees rises this many texels from one texel to the next.
  // Beside no surface (depth 0) everything is a jump.
  constexpr float steepest = 6.0f;
  const auto texel_per_depth = map.step / static_cast<float>(camera.K[0][0]);
  loops.mark_jumps(surface.data(), map.width, map.height, steepest * texel_per_depth,
                   distance.data());
  mark_frame(distance, map, camera);
  loops.spread_distances(distance.data(), map.width, map.height);
  // The margin covers the soft edge of a matte and the reach of a bilinear look-up. The depth is the
  // farthest of the neighbours: a slanted surface then never hides itself, and where a jump makes this
  // wrong the fade is 0.
  const MapScale scale{map.width,
                       map.height,
                       std::max(1.5f / map.step, 1.0f),
                       std::max(static_cast<float>(fade_width) / map.step, 1.0f),
                       map.near,
                       65534.0f / (map.far - map.near)};
  map.depth.resize(texels);
  map.fade.resize(texels);
  loops.finish_texels(surface.data(), distance.data(), scale, wide.data(), map.depth.data(),
                      map.fade.data());
}

}  // namespace polyhull
