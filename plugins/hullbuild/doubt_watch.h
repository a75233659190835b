// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the cameras of the sets of the last second say of each other.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "hull/repair/doubts.h"

namespace polyhull::element {

/// Silhouettes of which so much is cut away contradict each other; sound ones come to a hundredth.
inline constexpr double contradictory = 0.04;

/// A camera that sees what no other does, and a pixel of it.
struct Background {
  std::string camera;
  Vec2 pixel{0.0};
};

/// Cameras whose silhouettes contradict each other.
struct Contradiction {
  double share = 0.0;     ///< of the outlines that some other camera cuts away
  double tangency = 0.0;  ///< epipolar tangency error of `camera` with the others, px, and
  double others = 0.0;    ///< of the others among each other; 0: unknown
  std::string camera;     ///< that has moved, or is keyed badly; empty: it cannot be told which
  std::vector<Background> background;  ///< nothing is wrong but what these see
  bool rig = false;          ///< most cameras contradict each other; `camera` is empty then
  std::size_t agreeing = 0;  ///< so many of `cameras` do not, where `rig` is set
  std::size_t cameras = 0;
};

/// Sums doubts (hull/repair/doubts.h) over a second. For one thread.
class DoubtWatch {
 public:
  /// Takes what the set at running time \p now (ns) of \p cameras says.
  void add(std::int64_t now, const std::vector<std::string>& cameras, CameraDoubts doubts);

  /// Of the last second.
  Contradiction contradiction() const;

  /// Whether nothing of what the cameras but \p camera see is cut away; false where that is unknown.
  bool others_are_sound(const std::string& camera) const;

  void reset() { *this = DoubtWatch(); }

 private:
  struct Entry {
    std::int64_t time;
    CameraDoubts doubts;
  };
  std::deque<Entry> entries_;
  std::vector<std::string> cameras_;
  CameraDoubts sum_;
};

}  // namespace polyhull::element
