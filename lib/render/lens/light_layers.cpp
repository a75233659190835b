// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/light_layers.h"

#include <algorithm>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {

void LightLayers::resize(int columns, int rows, const Rectangle& subjects) {
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  if (columns != width || rows != height) {
    width = columns;
    height = rows;
    part = {};
    for (std::vector<float>& plane : scene) plane.resize(count);
    for (std::vector<float>& plane : subject) plane.assign(count, 0.0f);
  }
  for (std::vector<float>& plane : subject)
    for (int y = part.y; y < part.y + part.height; ++y)
      std::fill_n(&plane[pixel(part.x, y)], part.width, 0.0f);
  part = subjects;
}

void LightLayers::read(const DepthLayers& depths, const SharpPictures& sharp) {
  const bool without = sharp.full == sharp.scene;
  resize(depths.width(), depths.height(), without ? Rectangle{} : depths.part());
  const float* linear = srgb_to_linear_table();
  parallel_each(height, 8, 0, [&](int y) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) * sharp.stride;
    // What no depth is known of stays where it is.
    const std::uint8_t* full = sharp.full + row;
    const std::size_t first = pixel(0, y);
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x)
      for (std::size_t c = 0; c < 3; ++c) scene[c][first + x] = linear[full[4 * x + c]];
    if (y < part.y || y >= part.y + part.height) return;
    for (int x = part.x; x < part.x + part.width; ++x) {
      const std::size_t i = pixel(x, y);
      const float coverage = depths.coverage()[i];
      if (coverage == 0.0f) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        const float both = scene[c][i];
        scene[c][i] = linear[sharp.scene[row + 4 * x + static_cast<std::ptrdiff_t>(c)]];
        subject[c][i] = both - (1.0f - coverage) * scene[c][i];
      }
      subject[3][i] = coverage;
    }
  });
}

void LightLayers::picture(std::size_t c, std::size_t first, int count, float* to) const {
  const float* behind = &scene[c][first];
  const float* body = &subject[c][first];
  const float* coverage = &subject[3][first];
  for (int i = 0; i < count; ++i) to[i] = body[i] + (1.0f - coverage[i]) * behind[i];
}

void LightLayers::write(const std::uint8_t* full, int stride, std::uint8_t* target,
                        int target_stride) const {
  const std::uint8_t* codes = linear_to_srgb_table();
  parallel_for(static_cast<std::size_t>(height), 8, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<float> light(static_cast<std::size_t>(width));
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      const std::uint8_t* from = full + static_cast<std::ptrdiff_t>(y) * stride;
      std::uint8_t* to = target + static_cast<std::ptrdiff_t>(y) * target_stride;
      for (std::size_t c = 0; c < 3; ++c) {
        picture(c, pixel(0, y), width, light.data());
        for (std::size_t x = 0; x < light.size(); ++x)
          to[4 * x + c] = linear_to_srgb(light[x], codes);
      }
      for (std::size_t x = 0; x < light.size(); ++x) to[4 * x + 3] = from[4 * x + 3];
    }
  });
}

}  // namespace polyhull
