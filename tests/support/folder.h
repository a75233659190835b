// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A folder for a test's files.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace polyhull::test {

/// An empty folder, which goes with this object; where processes were forked meanwhile, with that of
/// the process that made it.
struct Folder {
  Folder() {
    if (mkdtemp(path.data()) == nullptr) std::abort();
  }
  ~Folder() {
    std::error_code ignored;
    if (getpid() == maker) std::filesystem::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string file(const std::string& name) const { return path + "/" + name; }
  std::filesystem::path operator/(const std::string& name) const { return file(name); }

  std::string path = (std::filesystem::temp_directory_path() / "polyhull_test_XXXXXX").string();
  pid_t maker = getpid();
};

}  // namespace polyhull::test
