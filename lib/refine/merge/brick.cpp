// SPDX-License-Identifier: LGPL-2.1-or-later
#include "refine/merge/brick.h"

namespace polyhull::refine {

unsigned CellRegion::faces_at(const BrickEdge& edge) const {
  const int at[3] = {edge.x, edge.y, edge.z};
  unsigned faces = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == edge.axis) continue;
    faces |= unsigned(at[axis] == low[axis]) << 2 * axis;
    faces |= unsigned(at[axis] == low[axis] + size[axis]) << (2 * axis + 1);
  }
  return faces;
}

const BrickEdge& Brick::edge_at(int index) {
  static const std::array<BrickEdge, 375> edges = [] {
    std::array<BrickEdge, 375> made;
    for (int i = 0; i < 375; ++i)
      made[i] = {i / 3 % nodes, i / (3 * nodes) % nodes, i / (3 * nodes * nodes), i % 3};
    return made;
  }();
  return edges[static_cast<std::size_t>(index)];
}

}  // namespace polyhull::refine
