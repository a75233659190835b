// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Time per element of a running pipeline, by GStreamer's tracing hooks: whenever a thread hands a
/// buffer from one element to the next, the processor time it has used since the last hand-over
/// goes to the element it was in. What elements do on threads of their own (GL, the shared pool) is
/// not seen here; their `stats` tell it.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <map>
#include <string>

#include "run/latency.h"

namespace polyhull {

struct ElementTime {
  std::uint64_t buffers_in = 0;  ///< handed to the element
  std::uint64_t buffers_out = 0;
  double first_in = 0.0;  ///< when the first and the last buffer came and left,
  double last_in = 0.0;   ///< seconds of the monotonic clock
  double first_out = 0.0;
  double last_out = 0.0;
  double cpu_seconds = 0.0;  ///< of the streaming threads, without what lies downstream
};

/// Starts the measurement for all pipelines of the process; call once, after gst_init(). Latency is
/// taken up to all sinks, and to what leaves the element \p output (empty: none).
void start_profile(const std::string& output);

/// What was measured so far, by element name; elements that are no longer alive included.
std::map<std::string, ElementTime> profile();

/// The latency of the frames that reached \p output: a sink, or the element that was given above.
LatencyReport latency_to(const std::string& output);

}  // namespace polyhull
