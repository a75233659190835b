// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Merges the cells of a brick into boxes: see merged_cells.h.
#pragma once

#include <memory>

#include "refine/field/cell_surface.h"
#include "refine/merge/brick.h"

namespace polyhull::refine {

/// Merges the cells of bricks and keeps the memory. One object per thread.
class BrickMerger {
 public:
  BrickMerger();
  ~BrickMerger();

  /// Finds where the surface crosses the edges of \p brick, and its boxes; `signs`, `active`, `rims` and
  /// `refused` are set.
  void merge(Brick& brick, const Level& fine, const Flatness& flatness);

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace polyhull::refine
