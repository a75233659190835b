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
/// cam1_left.png belong to cam1, cam10.png does not); files without either go to the cameras that
/// are left, in the rig's order. Throws Error, which calls the files \p option, for an unknown
/// camera, a camera with two files or more files than cameras.
std::vector<std::pair<std::size_t, std::string>> assign_files(const std::vector<std::string>& files,
                                                              const Rig& rig,
                                                              const std::string& option);

}  // namespace polyhull
