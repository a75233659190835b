// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which instants a live element works on when not all can be done, and how its sources hear of it.
///
/// The decision travels upstream as a custom event, `polyhull-pace`: a grid of wanted frames, the
/// running time from which on it holds, and how late a frame may come to be of use. An element that decides for itself and hears of a
/// decision from downstream follows the one that wants fewer frames. QoS events of sinks say what
/// is already too late.
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/gst.h>

#include <atomic>
#include <mutex>

#include "live/frame_grid.h"
#include "live/pace.h"
#include "plugins/common/statistics.h"

namespace polyhull::element {

inline constexpr char pace_event_name[] = "polyhull-pace";

/// From running time `from` on (ns) the frames of `grid` are wanted, as long as they come not more
/// than `patience` (ns) after their time.
struct PaceChange {
  FrameGrid grid;
  std::int64_t from = 0;
  std::int64_t patience = INT64_MAX;
};

GstEvent* make_pace_event(const PaceChange& change);

/// Whether \p event is such an event, which \p change then tells.
bool parse_pace_event(GstEvent* event, PaceChange& change);

/// What an element that works on single frames knows of the pace: it leaves out what is of no use.
/// Any thread.
class PaceFilter {
 public:
  /// Whether \p event told of a pace.
  bool hear(GstEvent* event);
  /// Whether the frame at running time \p time is of use at \p now (no_time: unknown).
  bool wanted(std::int64_t time, std::int64_t now) const;
  void reset();

 private:
  mutable std::mutex mutex_;  // protects all below
  FrameGrids grids_;
  std::int64_t patience_ = INT64_MAX;
};

/// For submit_input_buffer of a GstBaseTransform: passes \p input on to \p parent where it is
/// wanted; what is not counts in \p statistics as frames-unwanted and goes no further.
GstFlowReturn submit_wanted(GstBaseTransform* transform, const PaceFilter& pace,
                            Statistics& statistics, GstBaseTransformClass* parent,
                            gboolean discontinuous, GstBuffer* input);

/// The pace of one aggregator, which tells its sources.
class LivePace {
 public:
  /// Counts in \p statistics as frame-step. The element's sink pads are live pads.
  LivePace(GstElement* element, Statistics& statistics);

  void start();

  /// How late frames may come, ns.
  void set_patience(std::int64_t patience);

  /// Takes a pace or QoS event that comes from downstream (any thread; keeps no reference).
  void hear(GstEvent* event);

  /// Whether the instant at running time \p time (ns) is wanted.
  bool wanted(std::int64_t time) const;

  /// Whether a sink has said that what belongs to \p time comes too late for it.
  bool too_late(std::int64_t time) const { return time < earliest_; }

  /// Notes that the wanted instant \p time was lost, or was not, in a stream with \p interval
  /// between its instants (ns; 0: unknown, nothing is decided).
  void note(std::int64_t time, std::int64_t interval, bool lost);

  /// Whether the element itself asks for fewer frames than there are.
  bool thins() const { return pace_.step() > 1; }

  /// Tells the sources of the pads that do not know it yet. The streaming thread's, no lock held.
  void tell_sources();

 private:
  GstElement* element_;
  Statistics& statistics_;
  Pace pace_;  // these two: the streaming thread's
  std::int64_t kept_ = INT64_MIN;  // the last instant that was not lost
  std::atomic<std::int64_t> earliest_{INT64_MIN};
  mutable std::mutex mutex_;  // protects the rest
  FrameGrid own_, downstream_;
  FrameGrids grids_;
  PaceChange now_;              // what sources are to know
  std::uint64_t version_ = 1;   // of it
};

}  // namespace polyhull::element
