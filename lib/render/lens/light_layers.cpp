// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/lens/light_layers.h"

#include <algorithm>

#include "base/srgb.h"
#include "base/thread_pool.h"

namespace polyhull {

void LightLayers::read(const DepthLayers& depths, const SharpPictures& sharp) {
  width = depths.width();
  height = depths.height();
  const std::size_t count = depths.scene().size();
  scene.resize(count);
  subject.resize(count);
  subject_inverse.resize(count);
  const float* linear = srgb_to_linear_table();
  const auto light = [linear](const std::uint8_t* p) {
    return Float4{linear[p[0]], linear[p[1]], linear[p[2]], 0.0f};
  };
  const auto columns = static_cast<std::size_t>(width);
  const bool without = sharp.full == sharp.scene;
  parallel_for(static_cast<std::size_t>(height), 8, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * columns; i < end * columns; ++i) {
      const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i / columns) * sharp.stride +
                                4 * static_cast<std::ptrdiff_t>(i % columns);
      const Float4 full = light(sharp.full + at);
      const float coverage = without ? 0.0f : depths.coverage()[i];
      const float inverse = without ? 0.0f : depths.subject()[i];
      // What no depth is known of stays where it is.
      scene[i] = coverage > 0.0f ? light(sharp.scene + at) : full;
      subject[i] = Float4{};
      subject_inverse[i] = inverse;
      if (coverage == 0.0f) continue;
      subject[i] = full - (1.0f - coverage) * scene[i];
      for (int c = 0; c < 3; ++c) subject[i][c] = std::max(subject[i][c], 0.0f);
      subject[i][3] = coverage;
    }
  });
}

}  // namespace polyhull
