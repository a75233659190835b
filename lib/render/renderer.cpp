// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/renderer.h"

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

}  // namespace polyhull
