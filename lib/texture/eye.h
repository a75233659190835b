// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What one view sees of single points of a hull, and in which colour.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "base/srgb.h"
#include "base/vector.h"
#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/fill_samples.h"
#include "texture/texturing.h"

namespace polyhull {

static_assert(std::endian::native == std::endian::little);  // RGBA bytes are read as a word

/// The sRGB codes (from 0 on) of \p codes' light times \p colour; above 255 not clipped.
inline Vec3f with_colour(const Vec3f& codes, const Mat3f& colour) {
  Vec3f light;
  for (int c = 0; c < 3; ++c) light[c] = srgb_decoded(codes[c] / 255.0f);
  light = colour * light;
  for (int c = 0; c < 3; ++c) light[c] = 255.0f * srgb_encoded(std::max(light[c], 0.0f));
  return light;
}

/// One view, ready to be asked what it sees at points of the surface and in which colour.
class Eye {
 public:
  Eye(const Hull& hull, const Camera& camera, const FillPicture& picture, const OcclusionMap* map)
      : camera_(camera), picture_(picture), map_(map), distorted_(camera.has_distortion()) {
    const Mat3 KR = camera.K * camera.R;
    const Vec3 shift = camera.K * camera.to_camera(hull.origin);
    // Without a map each pixel is its own texel.
    const double step = map ? map->step : 1.0, x = map ? map->x : 0.0, y = map ? map->y : 0.0;
    for (int i = 0; i < 4; ++i) {
      const Vec3 column = i < 3 ? KR[i] : shift;
      // To the texels' corners, so that cutting off finds the nearest middle.
      column_[i] = Vec3f((column.x - x * column.z) / step + 0.5 * column.z,
                         (column.y - y * column.z) / step + 0.5 * column.z, column.z);
    }
    if (!map_) return;
    // As the renderers allow: the slope of a texel or two.
    unit_ = (map_->far - map_->near) / 65534.0f;
    tolerance_ = 3.0f * map_->step * map_->near / static_cast<float>(camera.K[0][0]) +
                 0.002f * (map_->far - map_->near);
  }

  /// With which fade the view sees \p point, and at which texel.
  float look(const Vec3f& point, Vec2f& at) const {
    const Vec3f p = column_[0] * point.x + column_[1] * point.y + column_[2] * point.z + column_[3];
    if (!(p.z > 0.0f) || picture_.pixels.empty()) return 0.0f;
    const float inverse = 1.0f / p.z;
    at = Vec2f(p.x * inverse, p.y * inverse);
    if (!map_) return 1.0f;
    if (!(at.x >= 0.0f && at.y >= 0.0f && at.x < static_cast<float>(map_->width) &&
          at.y < static_cast<float>(map_->height)))
      return 0.0f;
    const std::size_t texel =
        static_cast<std::size_t>(static_cast<int>(at.y) * map_->width + static_cast<int>(at.x));
    if (map_->fade[texel] == 0) return 0.0f;
    const float depth = map_->near + static_cast<float>(map_->depth[texel]) * unit_;
    return p.z > depth + tolerance_ ? 0.0f : static_cast<float>(map_->fade[texel]) / 255.0f;
  }

  /// The mean of the 3 x 3 pixels around look()'s place \p at, sRGB codes; none where the matte does not hold all
  /// of them.
  std::optional<Vec3f> colour(const Vec2f& at) const {
    const Vec2 real = pixel_of(at);
    if (!(std::abs(real.x) < 1e6 && std::abs(real.y) < 1e6)) return std::nullopt;
    return mean_around(static_cast<int>(std::lround(real.x)),
                       static_cast<int>(std::lround(real.y)));
  }

  /// The same, interpolated between pixels.
  std::optional<Vec3f> colour_between(const Vec2f& at) const {
    const Vec2 real = pixel_of(at);
    if (!(std::abs(real.x) < 1e6 && std::abs(real.y) < 1e6)) return std::nullopt;
    const double left = std::floor(real.x), top = std::floor(real.y);
    Vec3f sum(0.0f);
    for (int i = 0; i < 4; ++i) {
      const std::optional<Vec3f> mean =
          mean_around(static_cast<int>(left) + i % 2, static_cast<int>(top) + i / 2);
      if (!mean) return std::nullopt;
      const double across = real.x - left, down = real.y - top;
      sum +=
          static_cast<float>((i % 2 ? across : 1.0 - across) * (i / 2 ? down : 1.0 - down)) * *mean;
    }
    return sum;
  }

 private:
  /// The picture's pixel of look()'s place \p at.
  Vec2 pixel_of(const Vec2f& at) const {
    const Vec2 texel = Vec2(at) - 0.5;
    const Vec2 pixel =
        map_ ? Vec2(map_->x, map_->y) + static_cast<double>(map_->step) * texel : texel;
    return distorted_ ? camera_.distort(pixel) : pixel;
  }
  std::optional<Vec3f> mean_around(int column, int row) const {
    const Rectangle& roi = picture_.roi;
    const int x = column - roi.x, y = row - roi.y;
    if (x < 1 || y < 1 || x + 1 >= roi.width || y + 1 >= roi.height) return std::nullopt;
    constexpr std::uint32_t covered = 250;  // as the renderers': a matte without background in it
    std::uint32_t even = 0, odd = 0;        // red and blue, green: sums of nine bytes fit 16 bits
    for (int dy = -1; dy <= 1; ++dy) {
      const std::uint8_t* from = picture_.pixels.data() +
                                 static_cast<std::ptrdiff_t>(y + dy) * picture_.stride +
                                 4 * (x - 1);
      for (int dx = 0; dx < 3; ++dx, from += 4) {
        std::uint32_t rgba;
        std::memcpy(&rgba, from, 4);
        if (rgba >> 24 < covered) return std::nullopt;
        even += rgba & 0xff00ffu;
        odd += rgba >> 8 & 0xffu;
      }
    }
    const Vec3f mean = Vec3f(even & 0xffffu, odd, even >> 16) * (1.0f / 9.0f);
    return picture_.colour == Mat3f(1.0f) ? mean : with_colour(mean, picture_.colour);
  }

  const Camera& camera_;
  const FillPicture& picture_;
  const OcclusionMap* map_;
  bool distorted_;
  Vec3f column_[4];  // from local coordinates to (texel x times z, y times z, z)
  float unit_ = 0.0f, tolerance_ = 0.0f;
};

}  // namespace polyhull
