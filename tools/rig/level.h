// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig level: a world that stands on the stage's floor, with bounds from the floor up.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/check_pictures.h"
#include "rig/floor.h"
#include "rig/rig.h"

namespace polyhull {

/// Where the floor is, by one of `points`, `height`, `board` and `standing`, and what else the rig is
/// to say. Lengths without another unit are in the rig's, in the world that it has.
struct LevelRequest {
  std::vector<Vec3> points;      ///< of the floor, three or more; the first is the origin
  std::optional<double> height;  ///< of the floor along `up`
  std::vector<CameraPictureRings> standing;  ///< somebody who stands on it, at one instant
  std::optional<Vec3> up;      ///< points up; unset: as the rig says. Of points, their plane tells
  std::optional<Vec3> origin;  ///< lies above or on the new one
  std::string unit;            ///< the unit that the lengths are in; empty: as the rig says
  std::string stage;           ///< WIDTHxDEPTHxHEIGHT (x, z, y) around the origin, metres; empty:
                               ///< .7 of the cameras' distance to each side, and as high as that
  std::optional<Frame> board;  ///< the floor's frame by a board on it (level_board.h)
};

struct LevelledRig {
  Rig rig;           ///< y up, the floor at y = 0, which is where its bounds begin
  std::string text;  ///< what was found, a line each
};

/// Throws Error, saying what to do: no or more than one way to find the floor, points that span no
/// plane, silhouettes with no lowest point that two cameras see, a stage or unit that is none, a
/// direction of length 0.
LevelledRig level_rig(const Rig& rig, const LevelRequest& request);

/// The height along \p rig's `up` of the lowest point of the subject in \p pictures. Planes through
/// two cameras that touch the subject below touch it in a point whose pictures lie on both outlines
/// (hull/repair/tangency.h), the rim of a sole: so these are points of the subject itself, unlike
/// the lowest ones of its hull, which reaches below the soles where all cameras look down. Throws
/// Error where no two cameras see such a point.
double lowest_point(const Rig& rig, const std::vector<CameraPictureRings>& pictures);

}  // namespace polyhull
