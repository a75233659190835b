// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Handles that no silhouette tells of: those that are a hair thin, and those around a narrow tunnel.
///
/// Where a fin of the hull is about as thick as nothing, f hovers around 0, and the surface there is a
/// web with holes. The nodes with f of less than a hair's depth are taken out and put back from the
/// deepest one on (so the surface grows as the level set does; handles are found by local topology and
/// a forest of what hangs together, as in Kriegeskorte and Goebel, An efficient algorithm for
/// topologically correct segmentation of the cortical sheet, 2001): all but those that would join what
/// hangs together already. Once its neighbours have filled the hole, such a node comes back, too.
///
/// A tunnel through what is inside is a loop of what is outside, so the same fills tunnels: the nodes
/// outside that are near the surface and within the hull are taken out of the outside, and put back but
/// for those that would close a loop, which leaves a wall where the tunnel is narrowest. A hole that a
/// silhouette shows is outside the hull from end to end, and stays.
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

/// Fills tunnels through the solid f > 0 whose narrowest place is less than \p depth from their walls and
/// at most \p beyond outside the hull (Level::hull). \p level, \p labels and what is returned as above.
std::size_t fill_narrow_tunnels(Level& level, float depth, float beyond,
                                std::vector<std::uint32_t>& labels);

}  // namespace polyhull::refine
