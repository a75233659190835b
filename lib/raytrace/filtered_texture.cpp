// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/filtered_texture.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace polyhull {
namespace {

/// As TextureLevel stores it.
std::uint32_t stored(const Vec3f& linear) {
  std::uint32_t out = 0;
  for (int k = 0; k < 3; ++k)
    out |= static_cast<std::uint32_t>(std::lround(1023.0f * std::sqrt(linear[k]))) << (10 * k);
  return out;
}

}  // namespace

void FilteredTexture::add_level(const std::vector<Vec3f>& linear, int width, int height) {
  std::vector<std::uint32_t> texels;
  texels.reserve(static_cast<std::size_t>(width + 1) * (height + 1));
  for (int y = 0; y <= height; ++y)
    for (int x = 0; x <= width; ++x)
      texels.push_back(stored(linear[static_cast<std::size_t>(y % height) * width + x % width]));
  texels_.push_back(std::move(texels));
  levels_.push_back({texels_.back().data(), width, height, width + 1});
}

FilteredTexture::FilteredTexture(const Picture& picture) {
  int width = picture.width, height = picture.height;
  std::vector<Vec3f> fine(static_cast<std::size_t>(width) * height);
  for (std::size_t i = 0; i < fine.size(); ++i)
    for (int k = 0; k < 3; ++k) fine[i][k] = srgb_to_linear(picture.pixels[4 * i + k]);
  add_level(fine, width, height);
  while (width > 1 || height > 1) {
    const int columns = std::max(width / 2, 1), rows = std::max(height / 2, 1);
    std::vector<Vec3f> coarse;
    for (int y = 0; y < rows; ++y) {
      // An odd row or column at the end is left out, as graphics cards' makers do.
      const Vec3f* above = &fine[static_cast<std::size_t>(2 * y) * width];
      const Vec3f* below = &fine[static_cast<std::size_t>(std::min(2 * y + 1, height - 1)) * width];
      for (int x = 0; x < columns; ++x) {
        const int next = std::min(2 * x + 1, width - 1);
        coarse.push_back(0.25f * (above[2 * x] + above[next] + below[2 * x] + below[next]));
      }
    }
    fine = std::move(coarse);
    width = columns;
    height = rows;
    add_level(fine, width, height);
  }
}

Vec3f FilteredTexture::over(const Vec2f& uv, const Vec2f& du, const Vec2f& dv) const {
  Float4 mean;
  view_loops().over(levels(), &uv.x, &du.x, &dv.x, &mean);
  return {mean[0], mean[1], mean[2]};
}

}  // namespace polyhull
