// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "rig/floor.h"
#include "studio/calibration/calibrate.h"

namespace polyhull::calibration {
namespace {

Pose frame_of_board(const Calibration& c, std::size_t instant, double thickness) {
  const bool seen = std::ranges::any_of(c.take.views, [&](const View& view) {
    return view.instant == instant && c.adjusted.views[&view - c.take.views.data()].used;
  });
  if (!seen)
    throw Error(Error::Kind::bad_input,
                "The floor's view '{}' fits no camera's others, or no camera saw the board in it.",
                c.take.instants.at(instant));
  return floor_of_board(c.take.board, c.adjusted.boards[instant], thickness);
}

Pose frame_of_points(const Calibration& c, const std::vector<Vec3>& points) {
  std::vector<Vec3> centres;
  for (const Camera& camera : c.rig.cameras) centres.push_back(camera.centre());
  const Frame frame = floor_frame(points, centres);
  return {frame.R, frame.t};
}

}  // namespace

Pose floor_of_board(const Board& board, const Pose& pose, double thickness) {
  const Vec3 x = pose.R[0], up = -pose.R[2];  // the board's z goes into the floor
  const Mat3 R = glm::transpose(Mat3(x, up, glm::cross(x, up)));
  return {R, -(R * (pose(board.middle()) - thickness * up))};
}

void move_to_floor(Calibration& c, const Floor& floor) {
  const Pose move = floor.view ? frame_of_board(c, *floor.view, floor.thickness)
                               : frame_of_points(c, floor.points);
  const Pose back = inverse(move);
  for (std::size_t i = 0; i < c.adjusted.cameras.size(); ++i) {
    Camera& camera = c.adjusted.cameras[i];
    const Pose pose = Pose{camera.R, camera.t} * back;
    camera.R = pose.R;
    camera.t = pose.t;
    Uncertainty& u = c.adjusted.uncertainties[i];
    if (!std::isfinite(u.centre[0][0])) continue;
    u.centre = move.R * u.centre * back.R;
    u.rotation = move.R * u.rotation * back.R;
  }
  for (Pose& board : c.adjusted.boards) board = move * board;
  c.rig.cameras = c.adjusted.cameras;
  c.rig.up = Vec3(0.0, 1.0, 0.0);
}

}  // namespace polyhull::calibration
