// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The property `adaptive`: QoS events from downstream steer the polygon tolerance.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <mutex>

#include "silhouette/contour/adaptive_tolerance.h"

namespace polyhull::element {

/// Used from the streaming thread and from the thread that QoS events come in.
class ToleranceControl {
 public:
  /// The frame rate of the stream; 0/1 where it is not known.
  void set_stream_rate(int numerator, int denominator);

  /// Takes the load out of a QoS event. Its proportion is the time the slowest element took for a
  /// buffer over the time between two buffers of the stream. At a target below the stream's rate
  /// some frames may be late, and at a target above it all must be early. \p target_rate: 0 is the
  /// stream's.
  void observe(GstEvent* qos, double target_rate);

  double tolerance(double base) const;
  void reset();

 private:
  mutable std::mutex mutex_;  // protects all below
  AdaptiveTolerance adaptive_;
  double stream_rate_ = 0.0;
};

}  // namespace polyhull::element
