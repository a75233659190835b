// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scenes that ship: where a subject stands when no other scene is named.
#pragma once

#include <filesystem>
#include <string>

#include "scene/scene.h"

namespace polyhull {

/// Metres from the built-in room's middle to each wall, and from its floor to its ceiling.
inline constexpr float room_half = 3.2f, room_height = 3.0f;

/// The built-in room: a polished floor, a table, a pillar that can hide the subject, one area
/// light. Metres, y up, floor at y = 0. Its textures, which are most of the work, are computed once a
/// process, or taken from \p folder where an earlier process kept them; empty: they are not kept.
Scene room_scene(const std::filesystem::path& folder = {});

/// The room with what can be changed while it is shown: a door (the node "door", closed, its origin
/// in the hinges) to a corridor with a light of its own ("corridor lamp"), and a mirror on the wall.
Scene apartment_scene(const std::filesystem::path& folder = {});

/// Whether open_scene() takes \p name for one of these, not for a file.
bool is_builtin_scene(const std::string& name);

/// load_scene(), room_scene() for "" and "builtin:room", or apartment_scene() for "builtin:apartment".
/// Throws Error as load_scene(), and for other names of the kind.
Scene open_scene(const std::string& name, const std::filesystem::path& folder = {});

}  // namespace polyhull
