// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Sizes and places that no stage has: a forgotten unit, bounds that are not where the cameras
/// look.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

/// The point nearest to all optical axes, in world units; nothing where there are fewer than two
/// cameras or the axes are all but parallel.
std::optional<Vec3> common_point(const Rig& rig);

/// One sentence, with numbers and the likeliest cause, for each size of \p rig that is not a
/// stage's: cameras farther than 100 m or nearer than 5 cm from the middle of the stage, or the two
/// farthest from each other more than 200 m or less than 1 mm apart; a camera ten times as far as
/// the others or a tenth as far; bounds five times larger or fifty times smaller than the cameras'
/// distance, or away from where the cameras look; cameras under the bounds' floor; pictures that
/// are on their heads or sides by what `up` says.
std::vector<std::string> implausible_sizes(const Rig& rig);

}  // namespace polyhull
