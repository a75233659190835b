// SPDX-License-Identifier: LGPL-2.1-or-later
#include "studio/calibration/take.h"

#include <cmath>
#include <set>

#include "base/error.h"

namespace polyhull::calibration {
namespace {

void check_view(const View& view, const Take& take) {
  const std::string& camera = take.cameras.at(view.camera).name;
  const std::string& instant = take.instants.at(view.instant);
  if (view.ids.size() != view.corners.size())
    throw Error(Error::Kind::bad_input,
                "View '{}' of camera '{}' has {} corners and {} numbers for them.", instant, camera,
                view.corners.size(), view.ids.size());
  if (view.ids.size() < 6)
    throw Error(Error::Kind::bad_input,
                "View '{}' of camera '{}' has {} corners; at least 6 are needed.", instant, camera,
                view.ids.size());
  std::set<int> seen;
  for (std::size_t i = 0; i < view.ids.size(); ++i) {
    if (view.ids[i] < 0 || view.ids[i] >= take.board.count() || !seen.insert(view.ids[i]).second)
      throw Error(Error::Kind::bad_input,
                  "View '{}' of camera '{}' has corner {} twice, or the board lacks it.", instant,
                  camera, view.ids[i]);
    if (!std::isfinite(view.corners[i].x) || !std::isfinite(view.corners[i].y))
      throw Error(Error::Kind::bad_input,
                  "View '{}' of camera '{}' has a corner that is not finite.", instant, camera);
  }
}

}  // namespace

void check_board(const Board& board) {
  if (board.columns < 3 || board.rows < 3 || board.columns > 100 || board.rows > 100)
    throw Error(Error::Kind::bad_input,
                "The board has {}x{} inner corners; 3 to 100 each way can be used.", board.columns,
                board.rows);
  if (!board.named && board.columns == board.rows)
    throw Error(
        Error::Kind::bad_input,
        "A chessboard of {0}x{0} inner corners looks the same after a quarter turn; use one "
        "with one row more than columns.",
        board.columns);
  if (!(board.square >= 1e-4 && board.square <= 10.0))
    throw Error(Error::Kind::bad_input,
                "The board's squares have a side of {} mm; 0.1 mm to 10 m can be used. Measure one "
                "and give its length.",
                1e3 * board.square);
}

void check_take(const Take& take) {
  check_board(take.board);
  if (take.cameras.empty()) throw Error(Error::Kind::bad_input, "There is no camera to calibrate.");
  std::vector<std::set<std::size_t>> instants(take.cameras.size());
  for (const View& view : take.views) {
    check_view(view, take);
    if (!instants[view.camera].insert(view.instant).second)
      throw Error(Error::Kind::bad_input, "Camera '{}' has two views of instant '{}'.",
                  take.cameras[view.camera].name, take.instants[view.instant]);
  }
  for (std::size_t c = 0; c < take.cameras.size(); ++c) {
    const std::size_t views = instants[c].size();
    if (views == 0)
      throw Error(Error::Kind::bad_input, "Camera '{}' sees the board in no picture.",
                  take.cameras[c].name);
    if (!take.cameras[c].known && views < least_views)
      throw Error(
          Error::Kind::bad_input,
          "Camera '{}' sees the board in {} pictures; its lens needs at least {}, better 20, "
          "with the board tilted differently in each.",
          take.cameras[c].name, views, least_views);
  }
}

}  // namespace polyhull::calibration
