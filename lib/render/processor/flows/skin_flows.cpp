// SPDX-License-Identifier: LGPL-2.1-or-later
// What a skin takes from beside its place, for views that disagree (lib/texture/align).
#include <algorithm>

#include "render/processor/skin.h"
#include "render/subject/picture_flows.h"

namespace polyhull::processor {
// The flows between views that colour something.
void Skin::look_along(const Mesh& mesh, const Vec3& eye) {
  flows_.assign(views_.size(), {});
  if (!use_maps_) return;
  for (const PictureFlow& flow : mesh.texturing->flows) {
    const int slot = drawing_.slot_of_view[static_cast<std::size_t>(flow.view)];
    const int other = drawing_.slot_of_view[static_cast<std::size_t>(flow.other)];
    if (slot < 0 || other < 0 || flow.width < 2 || flow.height < 2) continue;
    const OcclusionMap& map = mesh.texturing->maps[static_cast<std::size_t>(flow.view)];
    flows_[static_cast<std::size_t>(slot)].push_back(
        {flow.offsets.data(), flow.width, flow.height, map.x, map.y,
         1.0f / (PictureFlow::coarser * map.step), PictureFlow::unit * map.step,
         static_cast<std::uint32_t>(other), flow_share(mesh, flow, eye)});
  }
}

// Moves a block's places in a view towards what the others show of them, by the others' shares.
void Skin::displace(const SkinScratch::View& view, int count, SkinScratch& s) const {
  if (flows_[view.slot].empty()) return;
  std::copy_n(view.u, count, s.from_u);
  std::copy_n(view.v, count, s.from_v);
  for (const SkinFlow& flow : flows_[view.slot]) {
    const auto other = std::find_if(s.views.begin(), s.views.end(),
                                    [&](const auto& of) { return of.slot == flow.other; });
    if (other == s.views.end()) continue;
    for (int i = 0; i < count; ++i) {
      float sum = 0.0f;
      for (const float* weight : s.weights) sum += weight[i];
      const float others = sum - view.weight[i];
      s.moved_share[i] =
          others > 0.0f ? other->weight[i] * flow.towards / std::max(others, 0.25f * sum) : 0.0f;
      s.moved_u[i] = s.from_u[i];
      s.moved_v[i] = s.from_v[i];
    }
    Loops::best().displace(flow, count, s.moved_share, s.moved_u, s.moved_v);
    for (int i = 0; i < count; ++i) {
      view.u[i] += s.moved_u[i] - s.from_u[i];
      view.v[i] += s.moved_v[i] - s.from_v[i];
    }
  }
}

}  // namespace polyhull::processor
