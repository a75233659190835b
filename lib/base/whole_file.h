// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Files that are read in one piece.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <system_error>

namespace polyhull {

/// The bytes of the file \p path, of a larger one the first \p most; none where there is no such file,
/// where it is a folder, and where it cannot be read to its end.
inline std::optional<std::string> whole_file(
    const std::filesystem::path& path, std::size_t most = std::numeric_limits<std::size_t>::max()) {
  std::ifstream file(path, std::ios::binary);
  std::error_code none;
  if (!file || std::filesystem::is_directory(path, none)) return std::nullopt;
  std::string bytes;
  char part[65536];
  while (file && bytes.size() < most) {
    file.read(part, static_cast<std::streamsize>(std::min(sizeof part, most - bytes.size())));
    bytes.append(part, static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) return std::nullopt;
  return bytes;
}

}  // namespace polyhull
