// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/studio.h"

#include <algorithm>
#include <cmath>

#include "base/thread_pool.h"
#include "rig/lens.h"

namespace polyhull {
namespace {

/// Two box passes of radius \p radius along one axis of a square map.
void smooth_axis(const std::vector<float>& in, std::vector<float>& out, int cells, int radius,
                 bool along_x) {
  const std::size_t step = along_x ? 1 : cells, next = along_x ? cells : 1;
  const float scale = 1.0f / static_cast<float>(2 * radius + 1);
  for (int line = 0; line < cells; ++line) {
    const float* source = in.data() + line * next;
    float* target = out.data() + line * next;
    float sum = 0.0f;
    for (int i = 0; i < radius; ++i) sum += source[i * step];
    for (int i = 0; i < cells; ++i) {
      if (i + radius < cells) sum += source[(i + radius) * step];
      if (i - radius - 1 >= 0) sum -= source[(i - radius - 1) * step];
      target[i * step] = std::max(sum * scale, 0.0f);
    }
  }
}

void smooth(std::vector<float>& map, std::vector<float>& scratch, int cells, int radius,
            int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    smooth_axis(map, scratch, cells, radius, true);
    smooth_axis(scratch, map, cells, radius, false);
  }
}

}  // namespace

void FloorShadow::cast(const SubjectFrame& frame, const std::vector<std::uint32_t>& triangles) {
  map_.assign(cells * cells, 0.0f);
  scratch_.assign(cells * cells, 0.0f);
  constexpr float per_metre = cells / (2.0f * reach);
  const auto mark = [&](const Vec3f& p) {
    // The lamps hang a little to the front left: the shadow leans to the back right. What is high
    // up is so far from the floor that its shadow dissolves.
    const float fade = 1.0f / (1.0f + 2.2f * std::max(p.y, 0.0f));
    const int x = static_cast<int>(std::floor((p.x - 0.22f * p.y + reach) * per_metre));
    const int z = static_cast<int>(std::floor((p.z - 0.30f * p.y + reach) * per_metre));
    if (x < 0 || z < 0 || x >= cells || z >= cells) return;
    float& cell = map_[static_cast<std::size_t>(z) * cells + x];
    cell = std::max(cell, fade);
  };
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Vec3f &a = frame.positions[triangles[t]], &b = frame.positions[triangles[t + 1]],
                &c = frame.positions[triangles[t + 2]];
    const float longest = std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
    // Of triangles smaller than a cell one corner is enough: the neighbours mark the others.
    if (longest * per_metre < 0.9f) {
      mark(a);
      continue;
    }
    const int steps = std::clamp(static_cast<int>(std::ceil(longest * per_metre)), 1, 4 * cells);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const float s = static_cast<float>(i) / static_cast<float>(steps);
        const float r = static_cast<float>(j) / static_cast<float>(steps);
        mark(a + (b - a) * s + (c - a) * r);
      }
    }
  }
  // A tight part at the feet and a wide one around.
  smooth(map_, scratch_, cells, 1, 2);
  std::vector<float> wide = map_;
  smooth(wide, scratch_, cells, 6, 3);
  for (std::size_t i = 0; i < map_.size(); ++i)
    map_[i] = std::min(0.6f * map_[i] + 0.9f * wide[i], 1.0f);
}

float FloorShadow::at(float x, float z) const {
  constexpr float per_metre = cells / (2.0f * reach);
  const float u = (x + reach) * per_metre - 0.5f, v = (z + reach) * per_metre - 0.5f;
  if (!(u >= 0.0f && v >= 0.0f && u < cells - 1 && v < cells - 1)) return 0.0f;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const float fu = u - static_cast<float>(i), fv = v - static_cast<float>(j);
  const float* m = map_.data() + static_cast<std::size_t>(j) * cells + i;
  return (m[0] * (1 - fu) + m[1] * fu) * (1 - fv) + (m[cells] * (1 - fu) + m[cells + 1] * fu) * fv;
}

void Screen::prepare(const Camera& camera, const Look& look, int index) {
  width_ = camera.width;
  height_ = camera.height;
  picture_.resize(static_cast<std::size_t>(width_) * height_ * 4);
  const double phase = 1.7 * index;
  parallel_for(height_, 16, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      std::uint8_t* pixel = picture_.data() + y * width_ * 4;
      const double v = (static_cast<double>(y) + 0.5) / height_;
      for (int x = 0; x < width_; ++x, pixel += 4) {
        const double u = (x + 0.5) / width_;
        const double wave = 0.45 * std::cos(3.1 * u + phase) +
                            0.35 * std::sin(2.3 * v - 0.5 * phase) -
                            0.9 * ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5));
        const double light = 1.0 + look.unevenness * std::clamp(wave, -1.0, 1.0);
        for (int c = 0; c < 3; ++c)
          pixel[c] =
              static_cast<std::uint8_t>(std::clamp(std::lround(look.colour[c] * light), 0L, 255L));
        pixel[3] = 255;
      }
    }
  });
}

void Screen::find_floor(const Camera& camera, const Placement& placement) {
  // The ray through the pixel met with the stage's y = 0.
  const Mat3 to_stage = glm::inverse(placement.linear);
  const Vec3 eye = to_stage * (camera.centre() - placement.origin);
  // Undoing the distortion takes long; between the nodes of a coarse grid rays are interpolated,
  // which for a soft shadow is close enough.
  constexpr int node = 16;
  const Lens lens(camera);
  const int columns = camera.width / node + 2, rows = camera.height / node + 2;
  std::vector<Vec3f> rays(static_cast<std::size_t>(columns) * rows);
  parallel_for(rows, 4, 0, [&](std::size_t first, std::size_t last) {
    for (std::size_t j = first; j < last; ++j) {
      for (int i = 0; i < columns; ++i) {
        const Vec2 pixel(i * node, static_cast<double>(j) * node);
        rays[j * columns + i] =
            Vec3f(to_stage * camera.ray(lens.active() ? lens.undistort(pixel) : pixel));
      }
    }
  });
  floor_.assign(static_cast<std::size_t>(camera.width) * camera.height, Vec2f(1e9f));
  spans_.assign(camera.height, {});
  parallel_for(camera.height, 16, 0, [&](std::size_t first, std::size_t last) {
    for (std::size_t y = first; y < last; ++y) {
      FloorSpan& span = spans_[y];
      const float fy = static_cast<float>(y % node) / node;
      for (int x = 0; x < camera.width; ++x) {
        const float fx = static_cast<float>(x % node) / node;
        const Vec3f* corner = &rays[y / node * columns + x / node];
        const Vec3f ray = glm::mix(glm::mix(corner[0], corner[1], fx),
                                   glm::mix(corner[columns], corner[columns + 1], fx), fy);
        const float s = ray.y != 0.0f ? static_cast<float>(-eye.y) / ray.y : -1.0f;
        const Vec2f at(static_cast<float>(eye.x) + s * ray.x,
                       static_cast<float>(eye.z) + s * ray.z);
        if (!(s > 0.0f) || std::abs(at.x) > FloorShadow::reach ||
            std::abs(at.y) > FloorShadow::reach)
          continue;
        if (span.begin == span.end) span.begin = x;
        span.end = x + 1;
        floor_[y * camera.width + x] = at;
      }
    }
  });
  first_row_ = camera.height;
  last_row_ = -1;
  for (int y = 0; y < camera.height; ++y) {
    if (spans_[y].begin == spans_[y].end) continue;
    first_row_ = std::min(first_row_, y);
    last_row_ = y;
  }
}

void Screen::add_shadow(const FloorShadow& shadow, double strength, int y,
                        std::uint8_t* pixels) const {
  const FloorSpan& span = spans_[y];
  const Vec2f* floor = floor_.data() + static_cast<std::size_t>(y) * width_ + span.begin;
  for (int x = span.begin; x < span.end; ++x, ++floor) {
    const float dark = shadow.at(floor->x, floor->y);
    if (dark <= 0.0f) continue;
    const float light = 1.0f - static_cast<float>(strength) * dark;
    std::uint8_t* pixel = pixels + 4 * static_cast<std::size_t>(x);
    for (int c = 0; c < 3; ++c)
      pixel[c] = static_cast<std::uint8_t>(static_cast<float>(pixel[c]) * light + 0.5f);
  }
}

}  // namespace polyhull
