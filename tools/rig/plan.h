// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig plan, and the forecast of polyhull-rig check.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "studio/plan/placing.h"

namespace polyhull {

/// The command line of polyhull-rig plan.
struct PlanArguments {
  PlanRequest request;
  std::string stage = "2.4x2.4x2.3", picture = "1920x1080", room;  ///< room: empty, none
  double distance = 0.0;                                           ///< 0: as near as may be
  std::string output, drawing;
};

/// Plans, prints the cameras and the forecast, notes the progress on standard error, writes the
/// drawing where one is asked for. Throws Error where sizes cannot be read, as plan_cameras(), and
/// (io) where the drawing cannot be written.
Rig run_plan(PlanArguments& arguments);

/// What to expect of \p rig and what one camera more would bring, as text; or why that cannot be
/// said, a sentence that begins with "no forecast: ".
std::string forecast_text(const Rig& rig);

/// The plan from above as SVG: the stage, the walls of \p room (x, z) where there is one, the cameras
/// with their fields of view, \p text below.
std::string plan_drawing(const std::vector<Camera>& cameras, const Stage& stage,
                         const std::optional<Vec2>& room, const std::string& text);

}  // namespace polyhull
