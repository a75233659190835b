// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/cameras/studio.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/thread_pool.h"
#include "rig/lens.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace polyhull {
namespace {

constexpr int node = 16;  // pixels between the nodes of the floor's coarse grid

/// Multiplies the colours of an RGBx pixel by \p light.
void darken(std::uint8_t* pixel, float light) {
#ifdef __SSE2__
  const __m128i none = _mm_setzero_si128();
  std::int32_t word;
  std::memcpy(&word, pixel, sizeof word);
  const __m128i codes = _mm_unpacklo_epi16(_mm_unpacklo_epi8(_mm_cvtsi32_si128(word), none), none);
  const __m128 darker =
      _mm_add_ps(_mm_mul_ps(_mm_cvtepi32_ps(codes), _mm_setr_ps(light, light, light, 1.0f)),
                 _mm_set1_ps(0.5f));
  const __m128i whole = _mm_packs_epi32(_mm_cvttps_epi32(darker), none);
  word = _mm_cvtsi128_si32(_mm_packus_epi16(whole, none));
  std::memcpy(pixel, &word, sizeof word);
#else
  for (int c = 0; c < 3; ++c)
    pixel[c] = static_cast<std::uint8_t>(static_cast<float>(pixel[c]) * light + 0.5f);
#endif
}

}  // namespace

void Screen::prepare(const Camera& camera, const Look& look, int index) {
  width_ = camera.width;
  height_ = camera.height;
  picture_.resize(static_cast<std::size_t>(width_) * height_ * 4);
  const double phase = 1.7 * index;
  std::vector<double> along(width_);
  for (int x = 0; x < width_; ++x) along[x] = 0.45 * std::cos(3.1 * ((x + 0.5) / width_) + phase);
  parallel_each(height_, 16, 0, [&](std::size_t y) {
    std::uint8_t* pixel = picture_.data() + y * width_ * 4;
    const double v = (static_cast<double>(y) + 0.5) / height_;
    const double down = 0.35 * std::sin(2.3 * v - 0.5 * phase);
    for (int x = 0; x < width_; ++x, pixel += 4) {
      const double u = (x + 0.5) / width_;
      const double wave = along[x] + down - 0.9 * ((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5));
      const double light = 1.0 + look.unevenness * std::clamp(wave, -1.0, 1.0);
      for (int c = 0; c < 3; ++c)
        pixel[c] = static_cast<std::uint8_t>(std::min(look.colour[c] * light + 0.5, 255.0));
      pixel[3] = 255;
    }
  });
}

void Screen::find_floor(const Camera& camera, const Placement& placement) {
  // The ray through the pixel met with the stage's y = 0.
  const Mat3 to_stage = glm::inverse(placement.linear);
  const Vec3 eye = to_stage * (camera.centre() - placement.origin);
  // Undoing the distortion takes long; between the nodes of a coarse grid rays are interpolated,
  // which for a soft shadow is close enough.
  const Lens lens(camera);
  const int columns = camera.width / node + 2, rows = camera.height / node + 2;
  constexpr Vec2f none(1e9f);
  const auto floor_point = [&](const Vec3f& ray) {
    const float s = ray.y != 0.0f ? static_cast<float>(-eye.y) / ray.y : -1.0f;
    return s > 0.0f
               ? Vec2f(static_cast<float>(eye.x) + s * ray.x, static_cast<float>(eye.z) + s * ray.z)
               : none;
  };
  std::vector<Vec3f> rays(static_cast<std::size_t>(columns) * rows);
  nodes_.resize(rays.size());
  node_columns_ = columns;
  parallel_each(rows, 4, 0, [&](std::size_t j) {
    for (int i = 0; i < columns; ++i) {
      const Vec2 pixel(i * node, static_cast<double>(j) * node);
      Vec3f& ray = rays[j * columns + i];
      ray = Vec3f(to_stage * camera.ray(lens.active() ? lens.undistort(pixel) : pixel));
      nodes_[j * columns + i] = floor_point(ray);
    }
  });
  floor_.assign(static_cast<std::size_t>(camera.width) * camera.height, none);
  spans_.assign(camera.height, {});
  parallel_each(camera.height, 16, 0, [&](std::size_t y) {
    Span& span = spans_[y];
    const float fy = static_cast<float>(y % node) / node;
    for (int x = 0; x < camera.width; ++x) {
      const float fx = static_cast<float>(x % node) / node;
      const Vec3f* corner = &rays[y / node * columns + x / node];
      const Vec3f ray = glm::mix(glm::mix(corner[0], corner[1], fx),
                                 glm::mix(corner[columns], corner[columns + 1], fx), fy);
      const Vec2f at = floor_point(ray);
      if (!(std::abs(at.x) <= FloorShadow::reach && std::abs(at.y) <= FloorShadow::reach)) continue;
      if (span.begin == span.end) span.begin = x;
      span.end = x + 1;
      floor_[y * camera.width + x] = at;
    }
  });
}

void Screen::find_shadow(const FloorShadow& shadow) {
  const auto is_floor = [](const Vec2f& p) { return p.x < 1e9f; };
  shadow_spans_.assign((height_ + node - 1) / node, {});
  for (std::size_t j = 0; j < shadow_spans_.size(); ++j) {
    Span& span = shadow_spans_[j];
    for (int i = 0; i + 1 < node_columns_; ++i) {
      const Vec2f* p = &nodes_[j * node_columns_ + i];
      const Vec2f corners[4] = {p[0], p[1], p[node_columns_], p[node_columns_ + 1]};
      // All that a cell below the horizon sees lies between what its corners see.
      Vec2f low = corners[0], high = corners[0];
      int floors = 0;
      for (const Vec2f& corner : corners) {
        low = glm::min(low, corner);
        high = glm::max(high, corner);
        floors += is_floor(corner);
      }
      if (floors == 0) continue;
      if (floors == 4 && (low.x > shadow.high().x || low.y > shadow.high().y ||
                          high.x < shadow.low().x || high.y < shadow.low().y))
        continue;
      if (span.begin == span.end) span.begin = i * node;
      span.end = (i + 1) * node;
    }
  }
}

void Screen::add_shadow(const FloorShadow& shadow, double strength, int y,
                        std::uint8_t* pixels) const {
  const Span &floor_span = spans_[y], &shadow_span = shadow_spans_[y / node];
  const int begin = std::max(floor_span.begin, shadow_span.begin);
  const int end = std::min(floor_span.end, shadow_span.end);
  const Vec2f* floor = floor_.data() + static_cast<std::size_t>(y) * width_;
  for (int x = begin; x < end; ++x) {
    if (!shadow.reaches(floor[x])) continue;
    const float dark = shadow.at(floor[x].x, floor[x].y);
    const float light = 1.0f - static_cast<float>(strength) * dark;
    darken(pixels + 4 * static_cast<std::size_t>(x), light);
  }
}

}  // namespace polyhull
