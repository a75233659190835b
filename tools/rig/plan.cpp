// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/plan.h"

#include <fmt/core.h>

#include <cstdio>
#include <iostream>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "picture_size.h"
#include "studio/plan/forecast.h"
#include "text_file.h"

namespace polyhull {
namespace {

void read_sizes(PlanArguments& arguments) {
  Stage& stage = arguments.request.stage;
  char rest = 0;
  if (std::sscanf(arguments.stage.c_str(), "%lfx%lfx%lf%c", &stage.width, &stage.depth,
                  &stage.height, &rest) != 3 ||
      !(stage.width > 0.0 && stage.depth > 0.0 && stage.height > 0.0)) {
    throw Error(Error::Kind::bad_input,
                "--stage is '{}'; expected WIDTHxDEPTHxHEIGHT in metres, such as 2.4x2.4x2.3.",
                arguments.stage);
  }
  std::tie(arguments.request.width, arguments.request.height) =
      picture_size("--picture", arguments.picture);
  if (!arguments.room.empty()) {
    Vec2 room;
    if (std::sscanf(arguments.room.c_str(), "%lfx%lf%c", &room.x, &room.y, &rest) != 2 ||
        !(room.x > 0.0 && room.y > 0.0)) {
      throw Error(Error::Kind::bad_input,
                  "--room is '{}'; expected WIDTHxDEPTH (x, z) in metres, such as 6x5.",
                  arguments.room);
    }
    arguments.request.room = room;
  }
  if (arguments.distance != 0.0) arguments.request.distance = arguments.distance;
}

std::string gain_text(const Forecast& now, const std::vector<Camera>& cameras, const Stage& stage) {
  const std::optional<Camera> found = one_more(cameras, stage);
  if (!found) return "";
  std::vector<Camera> more = cameras;
  more.push_back(*found);
  const Camera& added = more.back();
  const Forecast then = forecast_of(more, stage);
  // Means over other places say nothing.
  if (then.places != now.places || then.spread != now.spread) return "";
  const Vec3 centre = added.centre();
  return fmt::format(
      "one camera more would bring most at azimuth {:.0f}, {:.2f} m from the axis, {:.2f} m high:\n"
      "  hull {:.1f} instead of {:.1f} mm from the body, refined {:.1f} instead of {:.1f} mm,\n"
      "  outlines half way {:.1f} instead of {:.1f} %, seen by no camera {:.1f} instead of "
      "{:.1f} %\n",
      azimuth_of(added), distance_of(added), centre.y, then.hull_mean, now.hull_mean,
      then.refined_mean, now.refined_mean, 100.0 * then.overlap, 100.0 * now.overlap,
      100.0 * then.seen_by[0], 100.0 * now.seen_by[0]);
}

}  // namespace

Rig run_plan(PlanArguments& arguments) {
  read_sizes(arguments);
  const Stage& stage = arguments.request.stage;
  Rig rig;
  rig.cameras = plan_cameras(arguments.request, [](const std::string& line) {
    std::cerr << "polyhull-rig: " << line << "\n";
  });
  rig.bounds = stage.bounds();
  const Forecast forecast = forecast_of(rig.cameras, stage);
  const std::string text = text_of(forecast, rig.cameras);
  std::cout << table_of(rig.cameras, stage) << text;
  if (!arguments.drawing.empty()) {
    write_text(plan_drawing(rig.cameras, stage, arguments.request.room, text), arguments.drawing);
  }
  return rig;
}

std::string forecast_text(const Rig& rig) {
  try {
    if (rig.cameras.size() < 2) return "no forecast: a hull needs two cameras.\n";
    const StagedRig staged = staged_rig(rig);
    const Forecast forecast = forecast_of(staged.cameras, staged.stage);
    std::string text = table_of(staged.cameras, staged.stage) + text_of(forecast, staged.cameras);
    if (forecast.places > 0) text += gain_text(forecast, staged.cameras, staged.stage);
    return text;
  } catch (const Error& error) {
    return fmt::format("no forecast: {}\n", error.what());
  }
}

}  // namespace polyhull
