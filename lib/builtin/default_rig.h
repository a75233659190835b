// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The synthetic stage's cameras.
#pragma once

#include <string>

#include "rig/rig.h"

namespace polyhull {

/// The built-in rig: four cameras (cam0 .. cam3) of 1024x768, 3 m from the axis of a stage 4 m wide;
/// metres, y up, floor at y = 0, bounds 2.4 m wide and deep around the origin and 2.3 m high from
/// the floor.
Rig default_rig();

/// load_rig(), or default_rig() where \p path is empty. Throws Error as load_rig().
Rig open_rig(const std::string& path);

}  // namespace polyhull
