// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "studio/calibration/calibrate.h"

namespace polyhull::calibration {
namespace {

// From the old world to one with these axes (unit vectors) and origin.
Pose frame_of(const Vec3& x, const Vec3& y, const Vec3& origin) {
  const Mat3 R = glm::transpose(Mat3(x, y, glm::cross(x, y)));
  return {R, -(R * origin)};
}

Pose frame_of_board(const Calibration& c, std::size_t instant, double thickness) {
  const bool seen = std::ranges::any_of(c.take.views, [&](const View& view) {
    return view.instant == instant && c.adjusted.views[&view - c.take.views.data()].used;
  });
  if (!seen)
    throw Error(Error::Kind::bad_input,
                "The floor's view '{}' fits no camera's others, or no camera saw the board in it.",
                c.take.instants.at(instant));
  const Pose& board = c.adjusted.boards[instant];
  const Vec3 up = -board.R[2];  // the board's z goes into the floor
  return frame_of(board.R[0], up, board(c.take.board.middle()) - thickness * up);
}

Pose frame_of_points(const Calibration& c, const std::vector<Vec3>& points) {
  if (points.size() < 3)
    throw Error(Error::Kind::bad_input, "The floor needs 3 points; {} were given.", points.size());
  const Vec3 along = points[1] - points[0];
  // The plane's normal by Newell's method; for three points their cross product.
  Vec3 normal(0.0);
  double reach = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    normal += glm::cross(points[i] - points[0], points[(i + 1) % points.size()] - points[0]);
    reach = std::max(reach, glm::length(points[i] - points[0]));
  }
  if (!(glm::length(normal) > 1e-3 * reach * reach) || !(glm::length(along) > 0.0))
    throw Error(Error::Kind::bad_input,
                "The floor's points lie on a line; take three that span a triangle.");
  Vec3 up = glm::normalize(normal);
  // Cameras stand above the floor.
  double height = 0.0;
  for (const Camera& camera : c.rig.cameras) height += glm::dot(up, camera.centre() - points[0]);
  if (height < 0.0) up = -up;
  const Vec3 x = glm::normalize(along - glm::dot(along, up) * up);
  return frame_of(x, up, points[0]);
}

}  // namespace

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

Vec3 triangulate(const Rig& rig, const std::vector<std::pair<std::size_t, Vec2>>& seen) {
  Mat3 normal(0.0);
  Vec3 right(0.0);
  for (const auto& [c, pixel] : seen) {
    const Camera& camera = rig.cameras.at(c);
    const Vec3 d = glm::normalize(camera.ray(camera.undistort(pixel)));
    const Mat3 across = Mat3(1.0) - glm::outerProduct(d, d);
    normal += across;
    right += across * camera.centre();
  }
  if (seen.size() < 2 || !(std::abs(glm::determinant(normal)) > 1e-9))
    throw Error(Error::Kind::bad_input,
                "A point on the floor must be seen by two cameras from different sides.");
  return glm::inverse(normal) * right;
}

}  // namespace polyhull::calibration
