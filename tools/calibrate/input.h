// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What polyhull-calibrate reads: folders of pictures, known lenses.
#pragma once

#include <functional>

#include "studio/calibration/calibrate.h"
#include "studio/calibration/find_board.h"

namespace polyhull::calibrate_tool {

/// The pictures of one stage by camera and instant.
struct Pictures {
  std::vector<std::string> cameras;   ///< names, sorted
  std::vector<std::string> instants;  ///< names, sorted
  std::vector<std::vector<std::string>>
      files;  ///< [camera][instant]: path; empty where there is none
};

/// The PNG and JPEG files in the sub-folders of \p folder, one per camera. Pictures of one instant
/// share their name without ending; where no two folders share a name, the last number in it. Throws
/// Error: no such folder, no sub-folder, one without pictures, two pictures of one camera and
/// instant, names without a number where numbers are needed.
Pictures list_pictures(const std::string& folder);

/// The first picture's size is \p camera's; throws Error, naming \p file, for one of another size.
void take_size(int width, int height, const std::string& file, calibration::TakeCamera& camera);

/// Reads all pictures and looks for the board. Throws Error, naming the file, for pictures that
/// cannot be read or are not of their camera's size, and naming the camera where none of its pictures
/// shows the board, with what may be the reason. \p floor: the instant at which it lies on the floor.
calibration::Take find_views(const Pictures& pictures, const calibration::Target& target,
                             const std::string& floor, const calibration::Progress& progress);

/// Gives cameras of \p take the lens of the camera of that name in \p rig. Throws Error, naming the
/// camera, where the pictures are of another size, or no name fits.
void use_lenses(calibration::Take& take, const Rig& rig);

}  // namespace polyhull::calibrate_tool
