// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// polyhull-rig refine: a rig's poses from pictures of whoever walked between its cameras.
#pragma once

#include <string>
#include <vector>

#include "mask_contours.h"
#include "rig/rig.h"

namespace polyhull {

struct RefineArguments {
  /// CAMERA=FOLDER: a camera's pictures, whose names end in the number of their instant.
  std::vector<std::string> folders;
  std::vector<std::string> only;  ///< the names of the cameras that may move; none: all
  MaskSettings mask;
};

/// \p rig with other poses; a table of what was found goes to standard output. A picture that shows
/// no subject is left out, and said on standard error. Throws Error for an unknown camera, folders
/// without an instant that two of them have, and where the pictures do not hold the poses.
Rig refine_rig(const Rig& rig, const RefineArguments& arguments);

}  // namespace polyhull
