// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Handles that are a hair thin: where a fin of the hull is about as thick as nothing, f hovers
/// around 0, and the surface there is a web with holes.
///
/// The nodes with f of less than a hair's depth are taken out and put back from the deepest one on
/// (so the surface grows as the level set does; handles are found by local topology and a forest of
/// what hangs together, as in Kriegeskorte and Goebel, An efficient algorithm for topologically
/// correct segmentation of the cortical sheet, 2001): all but those that would join what hangs
/// together already. Once its neighbours have filled the hole, such a node comes back, too.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "refine/pieces/runs.h"

namespace polyhull::refine {

/// Cuts the handles of the solid f > 0 where they are less than \p hair deep and not \p needed, which
/// is asked about nodes. \p runs of \p level at 0, whose grid's border is outside (cut_at_hull()).
/// Returns how many nodes that took. \p labels is worked with: empty at first, then the last call's.
std::size_t cut_thin_handles(Level& level, const LevelRuns& runs, float hair,
                             const std::function<bool(const Vec3f& node)>& needed,
                             std::vector<std::uint32_t>& labels);

}  // namespace polyhull::refine
