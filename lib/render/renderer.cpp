// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/renderer.h"

#include <algorithm>
#include <cstring>

namespace polyhull {

RenderPlan Renderer::plan(const RenderFrame& frame, const RenderSettings& settings) {
  if (frame.scene != bounds_held_) {
    bounds_held_ = frame.scene;
    std::vector<Vec3f> points;
    if (frame.scene)
      for (const SceneMesh& mesh : frame.scene->meshes)
        points.insert(points.end(), mesh.positions.begin(), mesh.positions.end());
    scene_bounds_ = bounds_of(points);
  }
  return plan_frame(frame, settings, scene_bounds_);
}

void Renderer::render_yuv(const RenderFrame& frame, const RenderPlan& plan,
                          const RenderSettings& settings, const std::uint8_t* background,
                          int background_stride, const YuvPicture& target) {
  const int stride = 4 * frame.width;
  drawn_.resize(static_cast<std::size_t>(stride) * frame.height);
  const Rectangle part = yuv_part(plan.changed(), frame.width, frame.height);
  const int left = std::max(part.x - 1, 0);  // chroma looks at the column before
  for (int y = part.y; y < part.y + part.height; ++y)
    std::memcpy(drawn_.data() + static_cast<std::ptrdiff_t>(y) * stride + 4 * left,
                background + static_cast<std::ptrdiff_t>(y) * background_stride + 4 * left,
                4 * static_cast<std::size_t>(part.x + part.width - left));
  render(frame, plan, settings, background, background_stride, drawn_.data(), stride);
  write_yuv({drawn_.data(), stride, 0, 0}, part, target);
}

}  // namespace polyhull
