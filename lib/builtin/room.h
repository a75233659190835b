// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scene that ships: where a subject stands when no other scene is named.
#pragma once

#include <filesystem>
#include <string>

#include "scene/scene.h"

namespace polyhull {

/// The built-in room: a polished floor, a table, a pillar that can hide the subject, one area
/// light. Metres, y up, floor at y = 0. Its textures, which are most of the work, are computed once a
/// process, or taken from \p folder where an earlier process kept them; empty: they are not kept.
Scene room_scene(const std::filesystem::path& folder = {});

/// load_scene(), or room_scene() for "" and "builtin:room". Throws Error as load_scene().
Scene open_scene(const std::string& name, const std::filesystem::path& folder = {});

}  // namespace polyhull
