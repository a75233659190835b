// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Sets of a brick's nodes.
#pragma once

#include <bit>
#include <cstdint>

#include "refine/merge/brick.h"

namespace polyhull::refine {

/// A set of the brick's nodes: bit 25 z + 5 y + x.
__extension__ using NodeSet = unsigned __int128;

inline constexpr int node_step[3] = {1, Brick::nodes, Brick::nodes* Brick::nodes};

inline int count_of(NodeSet set) {
  return std::popcount(static_cast<std::uint64_t>(set)) +
         std::popcount(static_cast<std::uint64_t>(set >> 64));
}

/// The nodes whose places along x, y and z are among \p at.
inline NodeSet nodes_at(const unsigned (&at)[3]) {
  std::uint32_t slab = 0;
  for (int y = 0; y < Brick::nodes; ++y)
    if (at[1] >> y & 1) slab |= at[0] << Brick::nodes * y;
  NodeSet set = 0;
  for (int z = 0; z < Brick::nodes; ++z)
    if (at[2] >> z & 1) set |= NodeSet{slab} << Brick::nodes * Brick::nodes * z;
  return set;
}

}  // namespace polyhull::refine
