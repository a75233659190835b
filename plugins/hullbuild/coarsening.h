// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// hullbuild's `adaptive`: contours are coarsened here while sets come faster than they can be made
/// and taken on. It needs nothing of the sources, which may be on other machines, and no sink that
/// tells of its time: an encoder, a file or a slow server behind this element holds it up.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <mutex>

#include "mesh/mesh.h"
#include "silhouette/contour/adaptive_tolerance.h"
#include "silhouette/contour/approximate.h"

namespace polyhull::element {

/// How far contours are coarsened now. Any thread.
class LoadWatch {
 public:
  /// Takes a QoS event: a sink that keeps the time says itself how much of it there is, and while
  /// one does (for 2 s after each such word) note() is not listened to: that it held the set up may
  /// have been waiting.
  void hear(GstEvent* event);

  /// Notes that it took \p busy until the set of running time \p time was made and taken on, in a
  /// stream with \p interval between its instants (all ns; an interval of 0 says nothing).
  void note(std::int64_t time, std::int64_t busy, std::int64_t interval);

  /// px; 0: contours stay as they are.
  double tolerance() const;

  void reset();

 private:
  mutable std::mutex mutex_;  // protects the rest
  AdaptiveTolerance adaptive_;
  std::int64_t last_word_ = INT64_MIN;  // of a sink: running time
};

/// Coarsens contours of meshes. For one thread.
class Coarsener {
 public:
  /// Moves the contours of the views of \p mesh by no more than \p tolerance, px; 0: not at all. A
  /// contour of which nothing would be left stays.
  void coarsen(Mesh& mesh, double tolerance);

 private:
  Approximator approximator_;
  Rings rings_;
};

}  // namespace polyhull::element
