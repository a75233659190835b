// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What is said of names that a scene does not have.
#pragma once

#include <string>
#include <vector>

namespace polyhull {

/// "The scene 'house.glb' has no light 'a', 'b'; it has 1 'c', 2 'd'." \p missing is the list of those,
/// each in quotes; \p there the names of all, which \p numbered ones are told with from 1 on.
std::string missing_words(const std::string& scene, const char* kind, const std::string& missing,
                          const std::vector<std::string>& there, bool numbered);

/// Adds \p name, in quotes, to the list \p missing.
void add_missing(std::string& missing, const std::string& name);

}  // namespace polyhull
