// SPDX-License-Identifier: LGPL-2.1-or-later
#include <algorithm>
#include <cmath>

#include "base/median.h"
#include "studio/calibration/links_internal.h"

namespace polyhull::calibration {
namespace {

// What half of many instants says, so many say as well.
constexpr std::size_t most_instants = 40;

// Median over the shared instants of what is left when \p b stands to \p a by \p motion.
double motion_error(const Board& board, const SeenViews& a, const SeenViews& b,
                    const std::vector<std::size_t>& shared, const Pose& motion) {
  std::vector<double> errors;
  for (const std::size_t i : shared) {
    bool turned = false;
    errors.push_back(either_error(board, *b.at[i].view, b.camera, motion * a.at[i].pose, &turned));
  }
  return median(std::move(errors));
}

// The camera with its pictures reflected, and the board's corners numbered as it then sees them.
struct Reflected {
  Take take;
  LensStart start;
};

Reflected reflect(const Take& take, const LensStart& start, std::size_t c) {
  Reflected out{take, start};
  Camera& camera = out.start.camera;
  camera.K[2][0] = camera.width - 1 - camera.K[2][0];
  if (camera.distortion.size() >= 4) camera.distortion[3] = -camera.distortion[3];
  const Board& board = take.board;
  std::size_t n = 0;
  for (View& view : out.take.views) {
    if (view.camera != c) continue;
    for (Vec2& corner : view.corners) corner.x = camera.width - 1 - corner.x;
    for (int& id : view.ids) {
      // Along which side does not matter where the board looks the same turned; else only an even
      // number of corners keeps the colours of the squares.
      const int column = id % board.columns, row = id / board.columns;
      id = board.rows % 2 == 0 ? (board.rows - 1 - row) * board.columns + column
                               : row * board.columns + board.columns - 1 - column;
    }
    out.start.poses[n] = board_pose(board, view, camera, &out.start.rms[n]);
    ++n;
  }
  return out;
}

}  // namespace

std::vector<SeenViews> gather_views(const Take& take, const std::vector<LensStart>& starts) {
  std::vector<SeenViews> seen(take.cameras.size());
  for (std::size_t c = 0; c < seen.size(); ++c) {
    seen[c].camera = starts[c].camera;
    seen[c].at.assign(take.instants.size(), {});
  }
  std::vector<std::size_t> count(seen.size(), 0);
  for (const View& view : take.views) {
    const LensStart& start = starts[view.camera];
    const std::size_t i = count[view.camera]++;
    if (std::isfinite(start.rms[i])) seen[view.camera].at[view.instant] = {&view, start.poses[i]};
  }
  return seen;
}

Pose half_turn(const Board& board) {
  Mat3 R(1.0);
  R[0][0] = R[1][1] = -1.0;
  return {R, 2.0 * board.middle()};
}

double either_error(const Board& board, const View& view, const Camera& camera, const Pose& pose,
                    bool* turned) {
  const double error = view_error(board, view, camera, pose);
  *turned = false;
  if (!board.looks_same_turned()) return error;
  const double other = view_error(board, view, camera, pose * half_turn(board));
  *turned = other < error;
  return std::min(error, other);
}

Link link_of(const Board& board, const SeenViews& a, const SeenViews& b) {
  Link link;
  std::vector<std::size_t> all, shared;
  for (std::size_t i = 0; i < a.at.size(); ++i)
    if (a.at[i].view && b.at[i].view) all.push_back(i);
  link.instants = all.size();
  const std::size_t step = (all.size() + most_instants - 1) / most_instants;
  for (std::size_t n = 0; n < all.size(); n += step) shared.push_back(all[n]);

  std::vector<std::pair<double, Pose>> motions;
  for (const std::size_t i : shared) {
    motions.emplace_back(0.0, b.at[i].pose * inverse(a.at[i].pose));
    if (board.looks_same_turned())
      motions.emplace_back(0.0, b.at[i].pose * half_turn(board) * inverse(a.at[i].pose));
  }
  for (auto& [error, motion] : motions) {
    error = motion_error(board, a, b, shared, motion);
    if (error < link.error) {
      link.error = error;
      link.motion = motion;
    }
  }
  constexpr double another = 0.5;  // radians
  for (const auto& [error, motion] : motions)
    if (angle_of(glm::transpose(link.motion.R) * motion.R) > another)
      link.rival = std::min(link.rival, error);
  return link;
}

double contradiction_limit(const Camera& camera) {
  return 0.02 * std::hypot(camera.width, camera.height);
}

std::optional<std::size_t> find_mirrored(const Take& take, const std::vector<LensStart>& starts,
                                         std::pair<std::size_t, std::size_t> pair) {
  // Of both, the one whose reflection agrees with more cameras.
  std::optional<std::size_t> found;
  std::size_t most = 0;
  for (const std::size_t c : {pair.second, pair.first}) {
    const Reflected reflected = reflect(take, starts[c], c);
    std::vector<LensStart> changed = starts;
    changed[c] = reflected.start;
    const std::vector<SeenViews> seen = gather_views(reflected.take, changed);
    const std::size_t other = c == pair.first ? pair.second : pair.first;
    std::size_t agreeing = 0;
    bool mended = false;
    for (std::size_t d = 0; d < seen.size(); ++d) {
      if (d == c) continue;
      const Link link = link_of(take.board, seen[d], seen[c]);
      // One instant agrees with itself, mirrored or not.
      if (link.instants < 2 || link.error > contradiction_limit(seen[c].camera)) continue;
      ++agreeing;
      mended = mended || d == other;
    }
    if (mended && agreeing > most) {
      most = agreeing;
      found = c;
    }
  }
  return found;
}

}  // namespace polyhull::calibration
