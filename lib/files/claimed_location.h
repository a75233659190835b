// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Files that parts of this process write, so that no two write the same.
#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string>

#include "base/error.h"

namespace polyhull {

/// One location, held as long as this lives.
class ClaimedLocation {
 public:
  /// Throws Error where somebody else in this process holds \p location, a path or a pattern of
  /// paths, by this name or by another that leads there.
  explicit ClaimedLocation(const std::string& location)
      : path_(std::filesystem::weakly_canonical(std::filesystem::absolute(location)).string()) {
    const std::scoped_lock lock(mutex_);
    if (!taken_.insert(path_).second)
      throw Error(Error::Kind::bad_input,
                  "Another element already writes '{}', and their files would replace each other; "
                  "give each a location of its own.",
                  location);
  }
  ~ClaimedLocation() {
    const std::scoped_lock lock(mutex_);
    taken_.erase(path_);
  }
  ClaimedLocation(const ClaimedLocation&) = delete;
  ClaimedLocation& operator=(const ClaimedLocation&) = delete;

 private:
  inline static std::mutex mutex_;  // protects taken_
  inline static std::set<std::string> taken_;
  std::string path_;
};

}  // namespace polyhull
