// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a Contourer holds, for who gives it a picture row by row: tracer.begin(), tracer.push() for
/// each row, finish(). Internal.
#pragma once

#include <vector>

#include "silhouette/contour/contourer.h"
#include "silhouette/contour/steady_rings.h"
#include "silhouette/contour/trace_state.h"

namespace polyhull {

struct Contourer::State {
  Tracer::State tracer;
  Approximator approximator;
  Field unblurred;
  Rings traced, rings;
  std::vector<std::int32_t> parents;
  ContourSettings settings;  // that the rings were found with
  bool valid = false;
  silhouette::SteadyRings steady;  // what the rings were made of,
  bool may_stay = false;           // where the settings ask to remember it
  bool stayed = false;
  Rings last_traced, spliced, next;
  std::vector<RingNode> nodes;

  bool holds(const ContourSettings& now) const { return valid && settings == now; }
  /// The contours of what was pushed into the tracer.
  const Rings& finish(const ContourSettings& now);
  bool keep_still(const ContourSettings& now);
};

}  // namespace polyhull
