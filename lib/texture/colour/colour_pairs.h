// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How the colours differ that two cameras see at the same place, for colour_balance.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vector.h"
#include "hull/hull.h"
#include "rig/camera.h"
#include "texture/fill_samples.h"
#include "texture/texturing.h"

namespace polyhull {

/// A hull's views with their pictures, in the texturing's order.
struct ColourViews {
  std::span<const Camera> cameras;
  std::span<const FillPicture> pictures;  ///< one per camera; none without pixels
  const Texturing& texturing;
  int threads = 0;  ///< of the pool; 0: all
};

/// What views a < b say of each other's colours.
struct ColourPair {
  std::size_t a = 0, b = 0;
  /// By channel the mean of ln(light in a / light in b) of the middle half of the places that both
  /// see well: highlights and what is not where the hull says are left out.
  Vec3 ratio{0.0};
  /// By channel how sure that is: the number of places over their variance, as the spread of
  /// the middle half tells; of 4096 places all over the surface.
  Vec3 weight{0.0};
};

/// The pairs of views that see the same places well, by a, then b. The same for any number of threads.
std::vector<ColourPair> colour_pairs(const Hull& hull, const ColourViews& views);

}  // namespace polyhull
