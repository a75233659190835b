// SPDX-License-Identifier: LGPL-2.1-or-later
// A board in the world of cameras that are known: on the floor, seen by some of them.
#include "rig/level_board.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "builtin/default_rig.h"
#include "studio/calibration/calibrate.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

using namespace calibration;

/// Face up beside the origin, turned by 30 degrees.
Pose on_floor(double height) {
  const Vec3 x(std::cos(0.5), 0.0, std::sin(0.5)), z(0.0, -1.0, 0.0);
  return {Mat3(x, glm::cross(z, x), z), Vec3(-0.1, height, 0.3)};
}

/// What each of \p cameras sees of the board, with a noise of .1 px; \p turned: every second one counts
/// the corners from the other end.
std::vector<View> views_of(const Board& board, const Pose& pose, const std::vector<Camera>& cameras,
                           bool turned) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.1);
  std::vector<View> views;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    View view;
    view.camera = c;
    for (int id = 0; id < board.count(); ++id) {
      view.ids.push_back(turned && c % 2 == 1 ? board.count() - 1 - id : id);
      view.corners.push_back(*cameras[c].project(pose(board.corner(id))) +
                             Vec2(noise(random), noise(random)));
    }
    views.push_back(view);
  }
  return views;
}

/// How far the floor that the board tells is from y = 0 within 1 m of the board, metres.
double off_floor(const Pose& frame) {
  double most = 0.0;
  for (const Vec3& p : {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)})
    most = std::max(most, std::abs(frame(p).y));
  return most;
}

TEST(PlaceBoard, TellsTheFloorUnderIt) {
  const std::vector<Camera> cameras = default_rig().cameras;
  for (const Board& board : {Board{9, 6, 0.1, false}, Board{8, 6, 0.1, false}}) {
    const double thickness = 0.012;
    const std::vector<View> views =
        views_of(board, on_floor(thickness), cameras, board.looks_same_turned());
    const PlacedBoard placed = place_board(board, views, cameras);
    EXPECT_LT(placed.rms, 0.2);
    const Pose frame = floor_of_board(board, placed.pose, thickness);
    EXPECT_LT(off_floor(frame), 1e-3);
    const Vec3 middle = on_floor(thickness)(board.middle()) - Vec3(0, thickness, 0);
    EXPECT_LT(glm::length(frame(middle)), 1e-3);
    // x along the columns, to one end or the other where they look the same.
    const double along = glm::dot(glm::transpose(frame.R)[0], on_floor(0.0).R[0]);
    EXPECT_NEAR(board.looks_same_turned() ? std::abs(along) : along, 1.0, 1e-4);
  }
}

TEST(PlaceBoard, OneCameraIsEnoughButLessSure) {
  const std::vector<Camera> cameras = default_rig().cameras;
  const Board board{9, 6, 0.1, false};
  const std::vector<View> all = views_of(board, on_floor(0.0), cameras, false);
  for (const View& view : all) {
    const Pose frame = floor_of_board(board, place_board(board, {view}, cameras).pose, 0.0);
    EXPECT_LT(off_floor(frame), 0.01) << view.camera;
  }
}

TEST(PlaceBoard, InAnyUnitAndWorld) {
  std::vector<Camera> cameras = default_rig().cameras;
  const Mat3 turn = from_rows({0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0});
  for (Camera& camera : cameras) {
    camera.R = camera.R * glm::transpose(turn);
    camera.t = 1000.0 * camera.t - camera.R * Vec3(300, -70, 1000);
  }
  const Board board{9, 6, 100.0, false};
  const Pose pose = on_floor(0.0);
  const Pose moved{turn * pose.R, 1000.0 * (turn * pose.t) + Vec3(300, -70, 1000)};
  const std::vector<View> views = views_of(board, moved, cameras, false);
  const Pose frame = floor_of_board(board, place_board(board, views, cameras).pose, 0.0);
  EXPECT_LT(off_floor(frame * Pose{1000.0 * turn, Vec3(300, -70, 1000)}), 1.0);
}

TEST(PlaceBoard, CamerasThatContradictEachOtherAreNamed) {
  std::vector<Camera> cameras = default_rig().cameras;
  const Board board{9, 6, 0.1, false};
  const std::vector<View> views = views_of(board, on_floor(0.0), cameras, false);
  // Squares of another size than the cameras' unit says.
  Board wrong = board;
  wrong.square = 0.2;
  EXPECT_THROW(place_board(wrong, views, cameras), Error);
  cameras[2].t += Vec3(0.0, 0.5, 0.0);
  test::expect_refused([&] { place_board(board, views, cameras); }, "sees the board");
  EXPECT_THROW(place_board(board, {}, cameras), Error);
}

}  // namespace
}  // namespace polyhull
