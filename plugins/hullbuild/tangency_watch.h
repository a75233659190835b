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
  /// The number of the camera that they point at; -1: none.
  int camera() const { return camera_off(pairs_, cameras_.size()); }

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

/// Adds what \p tangencies say to \p contradiction: the camera, where that is not known yet; or that
/// it is the rig, where at most half of the cameras agree and, of four or more, enough of the outlines
/// is cut away.
void add_tangency(Contradiction& contradiction, const TangencyWatch& tangencies);

}  // namespace polyhull::element
