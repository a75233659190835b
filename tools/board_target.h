// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The board of a command line.
#pragma once

#include <cstdio>
#include <string>

#include "base/error.h"
#include "studio/calibration/find_board.h"

namespace polyhull {

/// Lengths in millimetres.
struct BoardArguments {
  std::string size, charuco;  ///< COLUMNSxROWS of inner corners; a dictionary, empty: a chessboard
  double square = 0.0, marker = 0.0;  ///< marker 0: as usual
};

/// Throws Error for what is no board.
inline calibration::Target target_of(const BoardArguments& arguments) {
  calibration::Target target;
  char rest = 0;
  if (std::sscanf(arguments.size.c_str(), "%dx%d%c", &target.board.columns, &target.board.rows,
                  &rest) != 2)
    throw Error(Error::Kind::bad_input,
                "--board is '{}'; expected COLUMNSxROWS of inner corners, such as 9x6.",
                arguments.size);
  target.board.square = 1e-3 * arguments.square;
  if (!arguments.charuco.empty()) {
    target.board.named = true;
    target.dictionary = arguments.charuco;
    if (arguments.marker > 0.0) target.marker = arguments.marker / arguments.square;
  }
  calibration::check_board(target.board);
  return target;
}

}  // namespace polyhull
