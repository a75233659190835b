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
  const float rise_u = b.inverse - a.inverse, rise_v = c.inverse - a.inverse;
  constexpr float slack = -1e-4f;  // seams between triangles stay closed
  for (int y = y0; y <= y1; ++y) {
    const float dy = static_cast<float>(y) - a.y;
    // Where the row may be inside, a texel wider than the edges say: triangles of hulls are thin.
    float left = static_cast<float>(x0), right = static_cast<float>(x1);
    const auto keep = [&](float slope, float rest) {  // where slope * dx + rest >= slack
      if (slope == 0.0f) return;
      const float edge = a.x + (slack - rest) / slope;
      if (slope > 0.0f)
        left = std::max(left, edge - 1.0f);
      else
        right = std::min(right, edge + 1.0f);
    };
    keep(ux, uy * dy);
    keep(vx, vy * dy);
    keep(-ux - vx, 1.0f - (uy + vy) * dy);
    if (!(left <= right)) continue;
    float* row = inverse.data() + static_cast<std::size_t>(y) * width;
    const int end = static_cast<int>(right);
    for (int x = static_cast<int>(left); x <= end; ++x) {
      const float dx = static_cast<float>(x) - a.x;
      const float u = ux * dx + uy * dy;
      const float v = vx * dx + vy * dy;
      const float value = a.inverse + u * rise_u + v * rise_v;
      const bool inside = (u >= slack) & (v >= slack) & (u + v <= 1.0f - slack);
      row[x] = inside ? std::max(row[x], value) : row[x];
    }
  }
}

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
      if (outside(x, y)) distance[static_cast<std::size_t>(y) * map.width + x] = 0;
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
  std::vector<int> distance = mark_jumps(surface, map.width, map.height, texel_per_depth);
  mark_frame(distance, map, camera);
  chamfer(distance, map.width, map.height);
  // The margin covers the soft edge of a matte and the reach of a bilinear look-up.
  const float margin = std::max(1.5f / map.step, 1.0f);
  const float ramp = std::max(static_cast<float>(fade_width) / map.step, 1.0f);
  map.fade.resize(texels);
  for (std::size_t p = 0; p < texels; ++p) {
    const float texels_away = static_cast<float>(distance[p]) / straight;
    const float fade = std::clamp((texels_away - margin) / ramp, 0.0f, 1.0f);
    map.fade[p] = static_cast<std::uint8_t>(255.0f * fade + 0.5f);
  }

  // The farthest of the neighbours: a slanted surface then never hides itself, and where a jump
  // makes this wrong the fade is 0.
  const std::vector<float> farthest = largest_around(surface, map.width, map.height);
  const float scale = 65534.0f / (map.far - map.near);
  map.depth.resize(texels);
  for (std::size_t p = 0; p < texels; ++p) {
    const int depth = static_cast<int>(std::clamp((farthest[p] - map.near) * scale, 0.0f, 65534.0f));
    map.depth[p] = static_cast<std::uint16_t>(farthest[p] == 0.0f ? 65535 : depth);
  }
  return map;
}

}  // namespace polyhull
