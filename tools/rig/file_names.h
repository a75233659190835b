// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Cameras' names as names of files, and back: a byte that not every program takes in a file's name
/// (blanks, slashes, control characters, '%', a dot in front) is written %XX, its hexadecimal value.
#pragma once

#include <string>
#include <string_view>

namespace polyhull {

/// The file name, without ending, of the camera \p name; two names never give the same one.
std::string file_name_of(std::string_view name);

/// The name for which file_name_of() gives \p stem; \p stem itself where no name does.
std::string name_of_file(std::string_view stem);

}  // namespace polyhull
