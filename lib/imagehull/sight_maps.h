// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What each view sees of an image-based hull (Matusik et al. 2000, section 5): occlusion maps as
/// those of a mesh, found by rays from the cameras.
#pragma once

#include <span>
#include <vector>

#include "imagehull/image_hull.h"
#include "texture/texturing.h"

namespace polyhull {

/// Texels of the longer side of a map: half a mesh's, since each costs a ray.
inline constexpr int sight_map_size = 160;

/// A map per view, of width 0 where \p wanted is 0; views side by side on the pool's threads.
std::vector<OcclusionMap> sight_maps(const ImageHull& hull, std::span<const Silhouette> views,
                                     std::span<const std::uint8_t> wanted);

}  // namespace polyhull
