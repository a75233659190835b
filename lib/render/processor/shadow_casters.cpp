// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/processor/shadow_casters.h"

namespace polyhull::processor {

void ShadowCasters::set(const RenderPlan& plan, const Light& light, bool same) {
  if (same) return;
  if (mesh_) caster_.remove_mesh(*mesh_);
  const SubjectsShape shape = shape_of(plan);
  mesh_ = caster_.add_mesh(shape.points, shape.triangles);
  caster_.commit();
  if (reach_.build(light, shape.points, shape.triangles)) ++map_;
}

}  // namespace polyhull::processor
