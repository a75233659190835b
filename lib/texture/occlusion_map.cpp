// SPDX-License-Identifier: LGPL-2.1-or-later
#include "texture/occlusion_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyhull {
namespace {

struct Corner {
  float x = 0.0f;  // texels
  float y = 0.0f;
  float inverse = 0.0f;  // 1 / camera depth, linear in the picture; 0: behind the camera
};

/// Writes the nearest 1/depth of one triangle that faces the camera.
void draw(const Corner& a, const Corner& b, const Corner& c, int width, int height,
          std::vector<float>& inverse) {
  // Front faces have negative area here: outside is counter-clockwise with y up, texels have y
  // down.
  const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (!(area < 0.0f)) return;
  // Clamped as floats: a corner just before the camera may lie beyond what an int holds.
  const auto first = [](float v, int size) {
    return static_cast<int>(std::ceil(std::clamp(v, 0.0f, static_cast<float>(size))));
  };
  const auto last = [](float v, int size) {
    return static_cast<int>(std::floor(std::clamp(v, -1.0f, static_cast<float>(size - 1))));
  };
  const int x0 = first(std::min({a.x, b.x, c.x}), width);
  const int x1 = last(std::max({a.x, b.x, c.x}), width);
  const int y0 = first(std::min({a.y, b.y, c.y}), height);
  const int y1 = last(std::max({a.y, b.y, c.y}), height);
  if (x0 > x1 || y0 > y1) return;
  const float scale = 1.0f / area;
  // Barycentric coordinates are linear in x and y; 1/depth with them.
  const float ux = (c.y - a.y) * scale, uy = -(c.x - a.x) * scale;
  const float vx = -(b.y - a.y) * scale, vy = (b.x - a.x) * scale;
  constexpr float slack = -1e-4f;  // seams between triangles stay closed
  for (int y = y0; y <= y1; ++y) {
    float* row = inverse.data() + static_cast<std::size_t>(y) * width;
    const float dy = static_cast<float>(y) - a.y;
    for (int x = x0; x <= x1; ++x) {
      const float dx = static_cast<float>(x) - a.x;
      const float u = ux * dx + uy * dy;
      const float v = vx * dx + vy * dy;
      if (u < slack || v < slack || u + v > 1.0f - slack) continue;
      const float value = a.inverse + u * (b.inverse - a.inverse) + v * (c.inverse - a.inverse);
      row[x] = std::max(row[x], value);
    }
  }
}

/// Distance in texels to the nearest texel that is 0 in \p distance, by a chamfer of steps 1 and
/// 1.4.
void chamfer(std::vector<float>& distance, int width, int height) {
  constexpr float straight = 1.0f, diagonal = 1.4f;
  const auto at = [&](int x, int y) -> float& {
    return distance[static_cast<std::size_t>(y) * width + x];
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float d = at(x, y);
      if (x > 0) d = std::min(d, at(x - 1, y) + straight);
      if (y > 0) {
        d = std::min(d, at(x, y - 1) + straight);
        if (x > 0) d = std::min(d, at(x - 1, y - 1) + diagonal);
        if (x + 1 < width) d = std::min(d, at(x + 1, y - 1) + diagonal);
      }
      at(x, y) = d;
    }
  }
  for (int y = height - 1; y >= 0; --y) {
    for (int x = width - 1; x >= 0; --x) {
      float d = at(x, y);
      if (x + 1 < width) d = std::min(d, at(x + 1, y) + straight);
      if (y + 1 < height) {
        d = std::min(d, at(x, y + 1) + straight);
        if (x > 0) d = std::min(d, at(x - 1, y + 1) + diagonal);
        if (x + 1 < width) d = std::min(d, at(x + 1, y + 1) + diagonal);
      }
      at(x, y) = d;
    }
  }
}

/// 0 on texels without surface or beside a jump in depth, far away elsewhere.
std::vector<float> mark_jumps(const std::vector<float>& depth, int width, int height,
                              float texel_per_depth) {
  const float far_away = static_cast<float>(width + height);
  // A surface seen at more than about 80 degrees rises this many texels from one texel to the next.
  constexpr float steepest = 6.0f;
  std::vector<float> distance(depth.size(), far_away);
  const auto jump = [&](std::size_t p, std::size_t q) {
    if (depth[p] == 0.0f || depth[q] == 0.0f) return depth[p] != depth[q];
    const float near = std::min(depth[p], depth[q]);
    return std::abs(depth[p] - depth[q]) > steepest * texel_per_depth * near;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * width + x;
      if (depth[p] == 0.0f) distance[p] = 0.0f;
      if (x + 1 < width && jump(p, p + 1)) distance[p] = distance[p + 1] = 0.0f;
      if (y + 1 < height && jump(p, p + width)) distance[p] = distance[p + width] = 0.0f;
    }
  }
  return distance;
}

/// 0 on texels outside the camera's frame, which hold no pixels.
void mark_frame(std::vector<float>& distance, const OcclusionMap& map, const Camera& camera) {
  const auto outside = [&](int x, int y) {
    const Vec2 ideal(map.x + x * map.step, map.y + y * map.step);
    const Vec2 real = camera.has_distortion() ? camera.distort(ideal) : ideal;
    return !(real.x >= 0.0 && real.y >= 0.0 && real.x <= camera.width - 1.0 &&
             real.y <= camera.height - 1.0);
  };
  // A map whose rim lies inside the frame does so as a whole: lenses bend no more than that here.
  bool any = false;
  for (int x = 0; x < map.width && !any; ++x) any = outside(x, 0) || outside(x, map.height - 1);
  for (int y = 0; y < map.height && !any; ++y) any = outside(0, y) || outside(map.width - 1, y);
  if (!any) return;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x)
      if (outside(x, y)) distance[static_cast<std::size_t>(y) * map.width + x] = 0.0f;
  }
}

}  // namespace

OcclusionMap draw_occlusion_map(const Hull& hull, const Camera& camera, int size,
                                double fade_width) {
  OcclusionMap map;
  const std::size_t count = hull.vertices.size();
  std::vector<Corner> corners(count);
  float low_x = std::numeric_limits<float>::max(), low_y = low_x, near = low_x;
  float high_x = -low_x, high_y = -low_x, far = 0.0f;
  // The same in one matrix: K (R X + t) for X relative to the hull's origin.
  const Mat3 KR = camera.K * camera.R;
  const Vec3 shift = camera.K * camera.to_camera(hull.origin);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = KR * Vec3(hull.vertices[i]) + shift;
    if (!(p.z > 0.0)) continue;
    Corner& corner = corners[i];
    corner = {static_cast<float>(p.x / p.z), static_cast<float>(p.y / p.z),
              static_cast<float>(1.0 / p.z)};
    low_x = std::min(low_x, corner.x);
    high_x = std::max(high_x, corner.x);
    low_y = std::min(low_y, corner.y);
    high_y = std::max(high_y, corner.y);
    near = std::min(near, static_cast<float>(p.z));
    far = std::max(far, static_cast<float>(p.z));
  }
  if (!(high_x >= low_x) || hull.triangles.empty()) return map;
  // What lies far outside the frame has no pixels to fade.
  low_x = std::max(low_x, -0.5f * static_cast<float>(camera.width));
  low_y = std::max(low_y, -0.5f * static_cast<float>(camera.height));
  high_x = std::min(high_x, 1.5f * static_cast<float>(camera.width));
  high_y = std::min(high_y, 1.5f * static_cast<float>(camera.height));
  if (!(high_x >= low_x) || !(high_y >= low_y)) return map;

  constexpr int border = 2;  // empty texels all around, so that clamped look-ups find fade 0
  const int inner = std::max(size, 8) - 2 * border - 1;
  map.step = std::max(std::max(high_x - low_x, high_y - low_y) / static_cast<float>(inner), 0.5f);
  map.x = low_x - border * map.step;
  map.y = low_y - border * map.step;
  map.width = static_cast<int>(std::ceil((high_x - low_x) / map.step)) + 2 * border + 1;
  map.height = static_cast<int>(std::ceil((high_y - low_y) / map.step)) + 2 * border + 1;
  map.near = near;
  map.far = std::max(far, std::nextafter(near, std::numeric_limits<float>::max()));

  for (Corner& corner : corners) {
    corner.x = (corner.x - map.x) / map.step;
    corner.y = (corner.y - map.y) / map.step;
  }
  const std::size_t texels = static_cast<std::size_t>(map.width) * map.height;
  std::vector<float> surface(texels, 0.0f);
  for (std::size_t f = 0; f + 2 < hull.triangles.size(); f += 3) {
    const Corner& a = corners[hull.triangles[f]];
    const Corner& b = corners[hull.triangles[f + 1]];
    const Corner& c = corners[hull.triangles[f + 2]];
    if (a.inverse == 0.0f || b.inverse == 0.0f || c.inverse == 0.0f) continue;
    draw(a, b, c, map.width, map.height, surface);
  }
  for (float& value : surface) value = value > 0.0f ? 1.0f / value : 0.0f;

  const auto texel_per_depth = map.step / static_cast<float>(camera.K[0][0]);
  std::vector<float> distance = mark_jumps(surface, map.width, map.height, texel_per_depth);
  mark_frame(distance, map, camera);
  chamfer(distance, map.width, map.height);

  // The margin covers the soft edge of a matte and the reach of a bilinear look-up.
  const float margin = std::max(1.5f / map.step, 1.0f);
  const float ramp = std::max(static_cast<float>(fade_width) / map.step, 1.0f);
  const float scale = 65534.0f / (map.far - map.near);
  map.depth.resize(texels);
  map.fade.resize(texels);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const std::size_t p = static_cast<std::size_t>(y) * map.width + x;
      const float fade = std::clamp((distance[p] - margin) / ramp, 0.0f, 1.0f);
      map.fade[p] = static_cast<std::uint8_t>(std::lround(255.0f * fade));
      // The farthest of the neighbours: a slanted surface then never hides itself, and where a jump
      // makes this wrong the fade is 0.
      float farthest = 0.0f;
      for (int j = std::max(y - 1, 0); j <= std::min(y + 1, map.height - 1); ++j)
        for (int i = std::max(x - 1, 0); i <= std::min(x + 1, map.width - 1); ++i)
          farthest = std::max(farthest, surface[static_cast<std::size_t>(j) * map.width + i]);
      map.depth[p] = farthest == 0.0f ? 65535
                                      : static_cast<std::uint16_t>(std::clamp(
                                            (farthest - map.near) * scale, 0.0f, 65534.0f));
    }
  }
  return map;
}

}  // namespace polyhull
