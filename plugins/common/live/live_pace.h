// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which instants a live element works on when not all can be done, and how its sources hear of it.
///
/// The decision travels upstream as a custom event, `polyhull-pace`: a grid of wanted frames, the
/// running time from which on it holds, and how late a frame may come to be of use. An element that
/// decides for itself and hears of a decision from downstream follows the one that wants fewer
/// frames. QoS events of sinks say what is already too late.
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

#include "live/pace_keeper.h"
#include "plugins/common/statistics.h"

namespace polyhull::element {

inline constexpr char pace_event_name[] = "polyhull-pace";

/// An event that tells \p change; the caller owns it.
GstEvent* make_pace_event(const PaceChange& change);

/// Whether \p event is such an event, which \p change then tells.
bool parse_pace_event(GstEvent* event, PaceChange& change);

/// For submit_input_buffer of a GstBaseTransform: passes \p input on to \p parent where it is
/// wanted; what is not counts in \p statistics as frames-unwanted and goes no further.
GstFlowReturn submit_wanted(GstBaseTransform* transform, const PaceFilter& pace,
                            Statistics& statistics, GstBaseTransformClass* parent,
                            gboolean discontinuous, GstBuffer* input);

/// The pace of one aggregator, which tells its sources.
class LivePace : private PaceKeeper {
 public:
  /// Counts in \p statistics as frame-step. The element's sink pads are live pads.
  LivePace(GstElement* element, Statistics& statistics)
      : element_(element), statistics_(statistics) {}

  /// As PaceKeeper::start(), and frame-step becomes 1.
  void start();
  using PaceKeeper::set_patience, PaceKeeper::wanted, PaceKeeper::too_late, PaceKeeper::thins;

  /// Takes a pace or QoS event that comes from downstream (any thread; keeps no reference).
  void hear(GstEvent* event);

  /// Notes that the wanted instant \p time was \p lost, or was not, in a stream with \p interval
  /// between its instants (both ns; interval 0: unknown, nothing is decided).
  void note(std::int64_t time, std::int64_t interval, bool lost);

  /// Tells the sources of the pads that do not know it yet. The streaming thread's, no lock held.
  void tell_sources();

 private:
  GstElement* element_;
  Statistics& statistics_;
};

}  // namespace polyhull::element
