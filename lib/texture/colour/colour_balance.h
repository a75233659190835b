// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Gains that make the cameras' colours agree where two of them see the same place.
///
/// Of each pair of cameras a, b the logarithms r_ab of the ratio of their light (colour_pairs.h) are
/// remembered, as running means that forget with a time constant, while both see the same places. By channel the gains g = exp(l)
/// minimise
///   sum w_ab (l_a - l_b + r_ab)^2 + w_0 sum l_a^2,
/// so that cameras that share nothing with others keep theirs and the geometric mean is 1: what all
/// cameras have in common, as exposure and white balance of the whole, stays. A diagonal model in
/// linear light (von Kries), as panoramas are balanced (Brown and Lowe 2007).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "texture/colour/colour_pairs.h"

namespace polyhull {

/// Balances one instant's cameras after the other's. Not for use by two threads at once.
class ColourBalance {
 public:
  /// No gain is above it nor below its inverse.
  static constexpr double most = 2.0;

  /// The gains of the views, whose cameras are called \p names, to be multiplied with linear colours.
  /// \p time: of the instant, seconds; none: a twenty-fifth after the last one. A change of a camera
  /// shows in its gain over \p time_constant seconds; the first instant's gains are its own. Time
  /// that goes back begins anew. What cameras not among the views looked like is remembered.
  /// Depends on nothing but what was given since then; the same for any number of threads.
  std::vector<Vec3f> update(const Hull& hull, const ColourViews& views,
                            std::span<const std::string_view> names, std::optional<double> time,
                            double time_constant);

  /// Forgets all.
  void reset();

 private:
  struct Pair {
    Vec3 weighted{0.0};  // ratio times weight
    Vec3 weight{0.0};
  };
  double share_of_news(std::optional<double> time, double time_constant);
  std::size_t number_of(std::string_view name);
  Pair& pair(std::size_t a, std::size_t b) { return pairs_[a * names_.size() + b]; }
  std::vector<double> solve(int channel) const;

  std::vector<std::string> names_;  // the cameras, as they came
  std::vector<Pair> pairs_;         // a < b
  std::optional<double> last_;      // the last instant's time
  double known_ = 0.0;              // seconds since the first one
};

}  // namespace polyhull
