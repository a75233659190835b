// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which of a scene's planar mirrors are to show subjects, as people write it: `auto` for all of them, or
/// names with semicolons between, those with spaces or semicolons in quotes:
///
///     floor; "tall mirror"
///     -window; -"glass door"
///
/// A name means the mirrors of a node of that name and of all that hangs on it, whole planes of tiles. Names with a minus are left
/// out; where there are others, those alone are shown, but for what is left out of them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "scene/scene.h"

namespace polyhull {

struct MirrorChoice {
  std::vector<std::string> shown;  ///< none: all
  std::vector<std::string> left_out;
};

/// Throws Error (bad_input) that says what of \p text is not understood; it may have 4096 bytes.
MirrorChoice parse_mirror_choice(std::string_view text);

struct ChosenMirrors {
  std::vector<bool> left_out;  ///< by Scene::mirrors; none: all are shown
  std::string missing;         ///< which names no mirror has, and which there are; empty: none
};

ChosenMirrors choose_mirrors(const MirrorChoice& choice, const Scene& scene);

}  // namespace polyhull
