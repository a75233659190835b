// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How far apart the views of one set are, and which camera is steadily beside the others.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace polyhull {

/// The time of one camera's view in a set, ns.
struct CameraTime {
  std::string camera;
  std::int64_t time = 0;
};

/// Of the last hundred sets. For one thread.
class SetSpread {
 public:
  struct Spread {
    std::int64_t smallest = 0, median = 0, largest = 0;  ///< ns
  };

  /// Adds a set of two cameras or more.
  void add(const std::vector<CameraTime>& set);

  /// Time between the first and the last view of a set; none: no sets.
  std::optional<Spread> spread() const;

  /// By how much each camera's views come after the median of their sets (before: negative), the
  /// median over its last hundred sets, ns. Cameras that the last hundred sets lack are left out.
  std::map<std::string, std::int64_t> offsets() const;

  void reset() { *this = SetSpread(); }

 private:
  std::deque<std::int64_t> spreads_;
  std::deque<std::vector<CameraTime>> offsets_;  // of the same sets
};

}  // namespace polyhull
