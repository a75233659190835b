// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Where to put cameras around a stage.
///
/// Candidates stand at every five degrees around the stage on a few heights, as near as the whole
/// stage stays in the picture. Cameras are taken one by one, each the one that helps most, and then
/// exchanged one by one as long as that helps (V. Fedorov's exchange of designs), from many
/// beginnings; what helps is judged by sights.h. Of the best different ends the one is taken whose
/// refined surface is nearest to the figure.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "studio/plan/sights.h"
#include "studio/plan/stage.h"

namespace polyhull {

/// What cameras there are and where they may stand.
struct PlanRequest {
  int cameras = 4;  ///< 2 to 64
  Stage stage;
  int width = 1920, height = 1080;  ///< of a picture
  double fov = 60.0;  ///< degrees from the picture's left to its right edge, 10 to 150
  /// Metres from the stage's axis; none: as near as the whole stage stays in the picture.
  std::optional<double> distance;
  /// Metres of the room around the stage's axis along x and z, within whose walls cameras stand: .3 m
  /// off them, and nearer than `distance` where these are nearer.
  std::optional<Vec2> room;
  /// Metres above the floor; none: three up to the stage's height.
  std::vector<double> heights;
};

/// All places that \p request allows, as cameras without a name. Throws Error (bad_input), with what
/// would do, where from one of the heights a picture does not hold the stage from 30 m away, or a
/// person from the distance that is given, where a person is less than 30 px tall, and where a room
/// has fewer places than cameras.
std::vector<Camera> candidates_of(const PlanRequest& request);

/// The planned cameras, named cam0, cam1, … by azimuth. Says what it does in \p progress, a line
/// each. The same in each run, for any number of threads. Throws Error as candidates_of() and
/// stage_bodies(), and for numbers out of range.
std::vector<Camera> plan_cameras(const PlanRequest& request,
                                 const std::function<void(const std::string&)>& progress = {});

/// Where one more camera helps most: of the first one's kind, around the stage, at the distances and
/// heights of \p cameras. None where no such picture holds a person.
std::optional<Camera> one_more(const std::vector<Camera>& cameras, const Stage& stage);

/// By how many degrees the two fail to face each other across the stage's axis, seen from above: 0
/// to 180.
double off_facing(const Camera& a, const Camera& b);

}  // namespace polyhull
