// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The solid f > a level as runs of nodes, row by row, its connected components and its handles.
/// Nodes hang together where they are side by side along an axis, as in marching cubes
/// (cell_surface.h); those outside over edges and corners, too.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "refine/field/contact_rays.h"

namespace polyhull::refine {

/// Nodes of a row that follow each other, all inside.
struct Run {
  int begin = 0, end = 0;
  std::uint32_t component = 0;
  std::uint32_t before =
      0;  ///< what is outside between it and the run before: a hollow, from 1 on;
          ///< 0: what is around all
};

struct LevelRuns {
  std::vector<Run> runs;
  std::vector<std::uint32_t> first;  ///< of each row, and one past the last
  std::uint32_t components = 0;      ///< numbered from 0 on in the order of their first nodes
  std::int64_t handles = 0;          ///< holes through it
  std::uint32_t hollows = 0;         ///< parts of the outside that it encloses

  std::span<const Run> row(std::size_t r) const {
    return {runs.data() + first[r], first[r + 1] - first[r]};
  }
};

/// The runs of \p level where f is above \p above.
LevelRuns find_runs(const Level& level, float above);

}  // namespace polyhull::refine
