// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which file of a command line belongs to which camera.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rig/rig.h"

namespace polyhull {

/// The camera (its number in \p rig) and the path of each of \p files. CAMERA=FILE names the
/// camera; else it is the one, of the longest name, that the file is named after (cam1.png and
/// cam1_left.png belong to cam1, cam10.png does not), or else its folder; files without any of
/// these go to the cameras that are left, in the rig's order. What the reader of the command may
/// have meant otherwise, files that went by order and a file of two cameras, is said on standard
/// error, where \p program speaks. Throws Error, which calls the files \p option, for an unknown
/// camera, a camera with two files or more files than cameras.
std::vector<std::pair<std::size_t, std::string>> assign_files(const std::vector<std::string>& files,
                                                              const Rig& rig,
                                                              const std::string& option,
                                                              const std::string& program);

}  // namespace polyhull
