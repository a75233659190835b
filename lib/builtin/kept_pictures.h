// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Pictures that take long to compute, kept in a file from one process to the next.
#pragma once

#include <filesystem>
#include <vector>

#include "base/picture.h"

namespace polyhull {

/// The pictures, RGBA, that keep_pictures() wrote to \p path; none where no whole such file is. A file
/// of another version of this program may hold other pictures than are wanted: look at them.
std::vector<Picture> kept_pictures(const std::filesystem::path& path);

/// Writes \p pictures, RGBA, to \p path and makes its folder; where that fails there is no file, or
/// the one before.
void keep_pictures(const std::vector<Picture>& pictures, const std::filesystem::path& path);

}  // namespace polyhull
