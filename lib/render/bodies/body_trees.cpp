// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/bodies/body_trees.h"

#include <algorithm>
#include <vector>

namespace polyhull {

bool stands_between(const Bounds& box, const Bounds& from, const Bounds& to) {
  double first = 0.0, last = 1.0;  // the part of the way where all axes overlap
  // What is at least 0 there is begin and ends as end.
  const auto keep = [&](double begin, double end) {
    if (begin < 0.0 && end < 0.0) last = -1.0;
    if (begin < 0.0 && end >= 0.0) first = std::max(first, begin / (begin - end));
    if (begin >= 0.0 && end < 0.0) last = std::min(last, begin / (begin - end));
  };
  for (int k = 0; k < 3; ++k) {
    keep(box.max[k] - from.min[k], box.max[k] - to.min[k]);
    keep(from.max[k] - box.min[k], to.max[k] - box.min[k]);
  }
  return first <= last;
}

void BodyTrees::make(std::size_t number, const Body& body) {
  Tree& tree = trees_[number];
  tree.used = true;
  if (body.content != 0 && tree.content == body.content && tree.placement == body.placement) return;
  if (tree.mesh) tree.caster.remove_mesh(*tree.mesh);
  tree.mesh.reset();
  tree.content = 0;  // where this fails the next call tries it again
  tree.mesh = tree.caster.add_mesh(body.points, body.triangles);
  tree.caster.commit();
  tree.content = body.content;
  tree.placement = body.placement;
}

void BodyTrees::hide(std::size_t number, std::span<const Ray> rays,
                     std::span<std::uint8_t> hidden) const {
  thread_local std::vector<std::uint8_t> met;
  met.resize(rays.size());
  trees_.at(number).caster.occluded(rays, met);
  for (std::size_t i = 0; i < rays.size(); ++i) hidden[i] |= met[i];
}

void BodyTrees::drop_unused() {
  std::erase_if(trees_, [](const auto& tree) { return !tree.second.used; });
  for (auto& [number, tree] : trees_) tree.used = false;
}

}  // namespace polyhull
