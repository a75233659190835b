// SPDX-License-Identifier: LGPL-2.1-or-later
// What a skin takes from beside its place, for views that disagree (lib/texture/align).
#include <algorithm>

#include "render/picture_flows.h"
#include "render/processor/skin.h"

namespace polyhull::processor {
namespace {

/// The weights of the point that \p item is of, as they are blended.
struct Blend {
  std::uint32_t first;  // entry
  std::uint32_t count;
  float sum;
};

Blend blend_of(const SkinItems& items, const std::vector<float>& weights, std::uint32_t item) {
  while (items[item].parts == 0) --item;
  Blend out{4 * item, 4u * items[item].parts, 0.0f};
  for (std::uint32_t c = 0; c < out.count; ++c) out.sum += weights[out.first + c];
  return out;
}

}  // namespace

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

// Moves the chosen points towards what the others show of them, by the others' shares.
void Skin::displace(std::size_t slot, const SkinItems& items, SkinScratch& s) const {
  if (flows_[slot].empty()) return;
  s.from_u = s.chosen_u;
  s.from_v = s.chosen_v;
  for (const SkinFlow& flow : flows_[slot]) {
    s.moved.clear();
    s.moved_share.clear();
    s.moved_u.clear();
    s.moved_v.clear();
    for (std::size_t j = 0; j < s.chosen_count; ++j) {
      const std::uint32_t entry = s.chosen[j];
      if (entry / 4 >= items.first_of_ribbon) break;  // the mattes stay where they are
      const Blend blend = blend_of(items, s.weights, entry / 4);
      const float others = blend.sum - s.weights[entry];
      for (std::uint32_t e = blend.first; others > 0.0f && e < blend.first + blend.count; ++e) {
        if (!(s.weights[e] > 0.0f) || (items[e / 4].slots >> (8 * (e % 4)) & 255u) != flow.other)
          continue;
        s.moved.push_back(static_cast<std::uint32_t>(j));
        s.moved_share.push_back(s.weights[e] * flow.towards / std::max(others, 0.25f * blend.sum));
        s.moved_u.push_back(s.from_u[j]);
        s.moved_v.push_back(s.from_v[j]);
      }
    }
    loops().displace(flow, static_cast<int>(s.moved.size()), s.moved_share.data(), s.moved_u.data(),
                     s.moved_v.data());
    for (std::size_t n = 0; n < s.moved.size(); ++n) {
      const std::uint32_t j = s.moved[n];
      s.chosen_u[j] += s.moved_u[n] - s.from_u[j];
      s.chosen_v[j] += s.moved_v[n] - s.from_v[j];
    }
  }
}

}  // namespace polyhull::processor
