// SPDX-License-Identifier: LGPL-2.1-or-later
#include "raytrace/filtered_texture.h"

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace polyhull {
namespace {

/// As TextureLevel stores it.
std::uint32_t stored(const Vec3f& linear) {
  // Not by std::lround, which is a call of a function.
  const auto code = [](float value) {
    return static_cast<std::uint32_t>(1023.0f * std::sqrt(value) + 0.5f);
  };
  return code(linear.x) | code(linear.y) << 10 | code(linear.z) << 20;
}

}  // namespace

void FilteredTexture::add_level(const std::vector<Vec3f>& linear, int width, int height) {
  const std::size_t stride = static_cast<std::size_t>(width) + 1;
  const std::size_t first = texels_.size();
  levels_.push_back({static_cast<int>(first), width, height, width + 1});
  texels_.resize(first + stride * (height + 1));
  std::uint32_t* texels = &texels_[first];
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    std::uint32_t* row = &texels[y * stride];
    for (int x = 0; x < width; ++x) row[x] = stored(linear[y * width + x]);
    row[width] = row[0];
  }
  std::copy_n(texels, stride, texels + stride * height);
}

FilteredTexture::FilteredTexture(const Picture& picture) {
  int width = picture.width, height = picture.height;
  std::vector<Vec3f> fine(static_cast<std::size_t>(width) * height);
  const float* linear = srgb_to_linear_table();
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const std::uint8_t* pixel = &picture.pixels[4 * i];
    fine[i] = {linear[pixel[0]], linear[pixel[1]], linear[pixel[2]]};
  }
  add_level(fine, width, height);
  while (width > 1 || height > 1) {
    const int columns = std::max(width / 2, 1), rows = std::max(height / 2, 1);
    std::vector<Vec3f> coarse;
    coarse.reserve(static_cast<std::size_t>(columns) * rows);
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
