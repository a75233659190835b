// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// When a live aggregator stops waiting, and the latency that follows from it.
///
/// An instant t is waited for until t + wait. The wait is what the inputs have shown to need, the
/// largest lateness of the last ten seconds and 6 ms (50 ms before anything has come), or what is
/// set by hand beyond the latency of the sources and of the stages between; the pads hold as much
/// as has to wait. The element reports the latency max(sources' latency, wait) + work, and
/// what hold() adds, work being the longest time that one instant has taken in the last ten seconds,
/// apart from the worst 0.6 s of them: what is made ready once, at the start, makes nobody wait.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <cstdint>
#include <mutex>

#include "live/lateness_window.h"
#include "plugins/common/live/live_pad.h"

namespace polyhull::element {

/// What users can set; both ns.
struct LiveSettings {
  std::uint64_t max_wait = GST_CLOCK_TIME_NONE;   ///< beyond the sources' latency; none: learn it
  std::uint64_t max_latency = 500 * GST_MSECOND;  ///< the longest wait that is learned, beyond it
};

/// The waiting of one aggregator.
class LiveTiming {
 public:
  /// For \p element, all of whose sink pads are live pads. To be made in its init().
  explicit LiveTiming(GstAggregator* element);

  /// At the start of the stream.
  void start(const LiveSettings& settings);

  /// After a flush.
  void flushed() { clock_.flushed(); }

  /// Running time, ns; no_time where it is not known.
  std::int64_t now() const { return clock_.now(); }

  /// Whether deadlines count. Not to be asked in get_next_time.
  bool live() const;

  /// Learns from the pads and posts a LATENCY message where the latency has changed.
  void update(const LiveSettings& settings);

  /// Notes how many seconds of work one instant has taken.
  void note_work(double seconds);

  /// From now on what is made of an instant is held back for \p time more, ns, which the latency
  /// has then in it.
  void hold(std::int64_t time) { held_ = time; }

  /// How long after its running time an instant is waited for, ns.
  std::int64_t wait() const { return wait_; }
  /// The latency that is reported, ns.
  std::int64_t latency() const { return latency_; }
  /// Adds both to \p stats, in ms: wait-ms, latency-ms.
  void tell(GstStructure* stats) const;
  /// How late anything may come to be waited for, ns.
  std::int64_t limit() const { return limit_; }

  /// Answers a LATENCY query in the place of the base class.
  bool answer(GstQuery* query);

  /// For get_next_time: the base class shall call aggregate() at running time \p deadline (ns).
  GstClockTime wake_at(std::int64_t deadline) const;

 private:
  std::int64_t reported_by_sources() const;
  bool learn(const LiveSettings& settings, bool playing);  // true: the latency has changed
  void make_room(std::int64_t room);
  bool ask_base(GstQuery* query);

  GstAggregator* element_;
  std::mutex mutex_;  // one thread learns at a time; protects work_
  LatenessWindow work_;
  std::atomic<std::int64_t> wait_{0}, work_time_{0}, held_{0}, latency_{0}, limit_{0};
  // How much the pads hold, which the base class takes for the sources' latency (its property
  // min-upstream-latency) and adds to deadlines, as it adds its property latency.
  std::atomic<std::int64_t> room_{0}, extra_{0};
  FlushedClock clock_;
  std::atomic<bool> answered_{false};  // upstream has answered, so the base class knows them
};

}  // namespace polyhull::element
