// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/level_board.h"

#include <ceres/ceres.h>
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/picture.h"
#include "studio/calibration/calibrate.h"
#include "studio/calibration/links.h"
#include "studio/calibration/projection.h"

namespace polyhull {

using namespace calibration;

namespace {

Pose camera_pose(const Camera& camera) {
  return {camera.R, camera.t};
}

/// The sum of the squared distances of all views, the board at \p pose.
double cost_of(const Board& board, const std::vector<View>& views,
               const std::vector<Camera>& cameras, const Pose& pose) {
  double cost = 0.0;
  for (const View& view : views) {
    bool turned = false;
    const Camera& camera = cameras[view.camera];
    const double error = either_error(board, view, camera, camera_pose(camera) * pose, &turned);
    cost += error * error * static_cast<double>(view.ids.size());
  }
  return cost;
}

/// Of the poses that the cameras tell alone the one that fits all best.
Pose first_pose(const Board& board, const std::vector<View>& views,
                const std::vector<Camera>& cameras) {
  Pose best;
  double least = std::numeric_limits<double>::infinity();
  for (const View& view : views) {
    const Camera& camera = cameras[view.camera];
    double rms = 0.0;
    const Pose pose = inverse(camera_pose(camera)) * board_pose(board, view, camera, &rms);
    if (!std::isfinite(rms)) continue;
    const double cost = cost_of(board, views, cameras, pose);
    if (!(cost < least)) continue;
    least = cost;
    best = pose;
  }
  if (!std::isfinite(least))
    throw Error(
        Error::Kind::bad_input,
        "No picture tells where the board is: its corners lie on a line, or what one camera "
        "sees is behind another one.");
  return best;
}

Pose adjusted(const Board& board, const std::vector<View>& views,
              const std::vector<Camera>& cameras, const Pose& start) {
  std::array<double, 6> parameters = to_parameters(start);
  std::vector<std::array<double, 6>> poses;
  poses.reserve(views.size());
  ceres::Problem problem;
  for (const View& view : views) {
    const Camera& camera = cameras[view.camera];
    poses.push_back(to_parameters(camera_pose(camera)));
    std::array<double, 12> k{};
    std::copy(camera.distortion.begin(), camera.distortion.end(), k.begin());
    using Function = ceres::AutoDiffCostFunction<KnownLensResidual, 2, 6, 6>;
    for (std::size_t i = 0; i < view.ids.size(); ++i)
      problem.AddResidualBlock(new Function(new KnownLensResidual{board.corner(view.ids[i]),
                                                                  view.corners[i], camera.K, k}),
                               nullptr, poses.back().data(), parameters.data());
    problem.SetParameterBlockConstant(poses.back().data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary.IsSolutionUsable() ? from_parameters(parameters.data()) : start;
}

}  // namespace

PlacedBoard place_board(const Board& board, std::vector<View> views,
                        const std::vector<Camera>& cameras) {
  const Pose start = first_pose(board, views, cameras);
  for (View& view : views) {
    bool turned = false;
    const Camera& camera = cameras[view.camera];
    either_error(board, view, camera, camera_pose(camera) * start, &turned);
    if (!turned) continue;
    for (int& id : view.ids) id = board.count() - 1 - id;
  }
  PlacedBoard out;
  out.pose = adjusted(board, views, cameras, start);
  double sum = 0.0, count = 0.0;
  for (const View& view : views) {
    const Camera& camera = cameras[view.camera];
    const double error = view_error(board, view, camera, camera_pose(camera) * out.pose);
    if (!(error <= contradiction_limit(camera)))
      throw Error(
          Error::Kind::bad_input,
          "Camera '{}' sees the board {:.0f} px beside where the other cameras have it. Did it lie "
          "still, are the board's squares and the rig's unit right, and did no camera move since "
          "the rig was calibrated?",
          camera.name, error);
    sum += error * error * static_cast<double>(view.ids.size());
    count += static_cast<double>(view.ids.size());
  }
  out.rms = std::sqrt(sum / std::max(count, 1.0));
  return out;
}

BoardFloor floor_by_board(const Rig& rig, const Target& target, double thickness,
                          const std::vector<std::pair<std::size_t, std::string>>& pictures) {
  const BoardFinder finder(target);
  std::vector<View> views;
  BoardFloor result;
  for (const auto& [index, path] : pictures) {
    const Camera& camera = rig.cameras[index];
    const Picture grey = load_picture(path, 1);
    if (grey.width != camera.width || grey.height != camera.height)
      throw Error(Error::Kind::bad_input,
                  "'{}' has {}x{} pixels, the rig's camera '{}' {}x{}; take the pictures as it was "
                  "calibrated.",
                  path, grey.width, grey.height, camera.name, camera.width, camera.height);
    std::optional<View> view = finder.find(grey, /*flat=*/true);
    if (!view) {
      result.text += fmt::format("the board is not seen by {} ({})\n", camera.name, path);
      continue;
    }
    view->camera = index;
    views.push_back(std::move(*view));
  }
  if (views.empty())
    throw Error(
        Error::Kind::bad_input,
        "The board is in none of the {} pictures. Has it {}x{} inner corners{}? A chessboard "
        "must be seen whole, sharp, in light enough that noise does not drown its squares, "
        "with a white margin.",
        pictures.size(), target.board.columns, target.board.rows,
        target.board.named ? " and markers of " + target.dictionary : "");
  Board board = target.board;
  board.square /= rig.metres_per_unit();
  const PlacedBoard placed = place_board(board, views, rig.cameras);
  const Pose frame = floor_of_board(board, placed.pose, thickness / rig.metres_per_unit());
  result.frame = {frame.R, frame.t};
  result.text += fmt::format(
      "the floor lies under the board, whose corners are {:.2f} px (root mean square) from where "
      "{} "
      "see{} them\n",
      placed.rms, views.size() == 1 ? "one camera" : fmt::format("{} cameras", views.size()),
      views.size() == 1 ? "s" : "");
  return result;
}

}  // namespace polyhull
