// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene that ships: where a subject stands when no other scene is named.
#pragma once

#include <string>

#include "scene/scene.h"

namespace polyhull {

/// The built-in room: a polished floor, a table, a pillar that can hide the subject, one area
/// light. Metres, y up, floor at y = 0.
Scene room_scene();

/// load_scene(), or room_scene() for "" and "builtin:room". Throws Error as load_scene().
Scene open_scene(const std::string& name);

}  // namespace polyhull
