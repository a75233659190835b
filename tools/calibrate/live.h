// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Boards shown to live cameras, taken into folders of pictures.
#pragma once

#include <string>
#include <vector>

#include "calibrate/live_cameras.h"
#include "studio/calibration/board_guide.h"
#include "studio/calibration/find_board.h"

namespace polyhull::calibrate_tool {

struct LiveTake {
  std::vector<LiveSource> sources;
  std::string folder;  ///< where the pictures go: CAMERA/NUMBER.png
  std::string show;    ///< elements that show what is covered; empty: none
  double every = 0.5;  ///< s between looks
  bool quiet = false;  ///< says nothing of each picture that is kept
  calibration::Enough enough;
};

/// Looks for the board in all cameras again and again, and keeps pictures that show it still, where
/// one shows something new, until there is enough, all cameras have ended, or the program is
/// interrupted (SIGINT, once). Throws Error: the folder is not empty or cannot be made, a camera
/// fails or sends nothing for 10 s at first, no picture was kept.
void take_live(const LiveTake& take, const calibration::Target& target);

}  // namespace polyhull::calibrate_tool
