// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Boards in pictures, found by OpenCV.
#pragma once

#include <memory>

#include "base/picture.h"
#include "studio/calibration/take.h"

namespace polyhull::calibration {

/// What to look for.
struct Target {
  Board board;
  /// ChArUco: the markers' side as a part of the square's, and OpenCV's name of the dictionary,
  /// such as "4X4_50".
  double marker = 0.75;
  std::string dictionary;
};

/// Finds one kind of board. find() may be called from several threads at once.
class BoardFinder {
 public:
  /// Throws Error (bad_input) for a dictionary that does not exist or has too few markers.
  explicit BoardFinder(const Target& target);

  /// The corners' numbers and places in the grey picture (ids and corners of the view), or nothing.
  /// A chessboard must be seen whole; its corners are numbered so that the first square between
  /// corners is dark, where the board's form allows that.
  /// \p flat: it may lie on the floor, far off and seen from low down; looking for that takes longer.
  std::optional<View> find(const Picture& grey, bool flat = false) const;

  /// The board as it is to be printed or drawn, \p square pixels a square, with a white margin of
  /// one square; the centre of corner 0 is at (2, 2) * square - 0.5.
  Picture draw(int square) const;

 private:
  struct Private;
  std::shared_ptr<const Private> self_;
};

}  // namespace polyhull::calibration
