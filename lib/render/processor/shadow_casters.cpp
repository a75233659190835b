// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/shadow_casters.h"

#include <vector>

namespace polyhull::processor {

void ShadowCasters::set(const RenderPlan& plan, const Light& light, bool same) {
  if (same) return;
  if (mesh_) caster_.remove_mesh(*mesh_);
  std::vector<Vec3f> points;
  std::vector<std::uint32_t> triangles;
  for (const PlacedSubject& subject : plan.subjects) {
    const auto base = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), subject.points.begin(), subject.points.end());
    for (const std::uint32_t index : subject.mesh->hull.triangles)
      triangles.push_back(base + index);
  }
  mesh_ = caster_.add_mesh(points, triangles);
  caster_.commit();
  if (reach_.build(light, points, triangles)) ++map_;
}

}  // namespace polyhull::processor
