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

/// Cameras whose silhouettes contradict each other.
struct Contradiction {
  double share = 0.0;        ///< of the outlines that some other camera cuts away
  double tangency = 0.0;     ///< epipolar tangency error of `camera` with the others, px, and
  double others = 0.0;       ///< of the others among each other; 0: unknown
  std::string camera;        ///< that has moved, or is keyed badly; empty: it cannot be told which
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
