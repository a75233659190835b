// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pairs of cameras, between links.cpp, which links all of them, and link.cpp.
#pragma once

#include <limits>
#include <optional>
#include <utility>

#include "studio/calibration/links.h"

namespace polyhull::calibration {

/// A view with the board's pose before its camera; no view: none of that instant.
struct SeenView {
  const View* view = nullptr;
  Pose pose;
};

/// What one camera saw, by instants.
struct SeenViews {
  Camera camera;
  std::vector<SeenView> at;
};

/// How one camera stands to another.
struct Link {
  std::size_t instants = 0;  ///< that both saw
  /// Median over the shared instants of the distances (root mean square, px) that are left.
  double error = std::numeric_limits<double>::infinity();
  /// The same for the best motion that is quite another one.
  double rival = std::numeric_limits<double>::infinity();
  Pose motion;  ///< from the one camera to the other
};

/// The views of \p take by camera and instant, with the poses of \p starts.
std::vector<SeenViews> gather_views(const Take& take, const std::vector<LensStart>& starts);

/// Turns a board on itself by half: corner i goes where the last but i was.
Pose half_turn(const Board& board);

/// The motion from \p a to \p b by their shared instants.
Link link_of(const Board& board, const SeenViews& a, const SeenViews& b);

/// Which of the cameras of \p pair, whose views contradict each other, shows mirrored pictures:
/// reflected ones agree with the other camera's. None where that does not mend it; the first of the
/// pair where both would do and no third camera tells which.
std::optional<std::size_t> find_mirrored(const Take& take, const std::vector<LensStart>& starts,
                                         std::pair<std::size_t, std::size_t> pair);

}  // namespace polyhull::calibration
