// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The epipolar tangency errors (hull/repair/tangency.h) of the last moments.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "hull/repair/tangency.h"
#include "plugins/hullbuild/doubt_watch.h"

namespace polyhull::element {

/// For one thread.
class TangencyWatch {
 public:
  /// Takes what the set at running time \p now (ns) of \p cameras says; whether pairs() are new.
  bool add(std::int64_t now, const std::vector<std::string>& cameras,
           std::vector<Tangency> tangencies);

  /// Of the last .6 seconds, looked at anew every fifth of one; the views are numbers of cameras().
  const std::vector<PairTangency>& pairs() const { return pairs_; }
  const std::vector<std::string>& cameras() const { return cameras_; }
  /// How the planes of the last set judge camera number \p camera.
  struct Touches {
    double sound = 0.0;  ///< the share of the planes that it agrees about with others
    Vec2 farthest{0.0};  ///< where its outline misses another's by most, px
  };
  Touches touches(std::size_t camera) const;

  void reset() { *this = TangencyWatch(); }

 private:
  struct Entry {
    std::int64_t time;
    std::vector<Tangency> tangencies;
  };
  std::deque<Entry> entries_;
  std::vector<std::string> cameras_;
  std::vector<PairTangency> pairs_;
  std::int64_t looked_at_ = 0;  // running time of pairs_
};

/// Adds what \p tangencies say to \p contradiction, which \p doubts made: the camera, where that is
/// not known yet; or that it is the rig, where at most half of the cameras agree and, of four or more,
/// enough of the outlines is cut away.
///
/// Background stays where a camera agrees with the others about a third of the planes or more: one
/// whose focal length or distance is wrong sees more than the others on all sides. Added is a camera
/// that is off by so much that it would cut the others' outlines and does not.
void add_tangency(Contradiction& contradiction, const DoubtWatch& doubts,
                  const TangencyWatch& tangencies);

}  // namespace polyhull::element
