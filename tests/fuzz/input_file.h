// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Fuzzers' input for readers of files.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace polyhull::fuzz {

/// Writes \p bytes to the file \p name and returns its path: in the folder for temporary ones, of this
/// process, in a folder of its own, where an address in it leads to nothing else.
inline std::string input_file(std::string_view bytes, const std::string& name) {
  static const std::filesystem::path folder = [] {
    auto made =
        std::filesystem::temp_directory_path() / ("polyhull_fuzzer_" + std::to_string(getpid()));
    std::filesystem::create_directories(made);
    return made;
  }();
  std::ofstream(folder / name, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return (folder / name).string();
}

}  // namespace polyhull::fuzz
