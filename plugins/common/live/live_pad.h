// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Sink pads of aggregators in live streams: they know how late what comes is, and what their
/// sources say of latency. LiveTiming makes them hold what has to wait for other inputs.
#pragma once

#include <gst/base/gstaggregator.h>

#include <atomic>
#include <cstdint>
#include <vector>

#include "live/punctuality.h"
#include "mesh/view.h"
#include "plugins/common/element.h"

namespace polyhull::element {

/// A buffer that waits, with the segment that its times belong to.
struct Arrival {
  GstBuffer* buffer = nullptr;
  GstSegment segment;
  std::int64_t shift = 0;  ///< what is added to its running times, ns

  /// \p time of the segment as running time, ns; no_time where there is none.
  std::int64_t running_time(GstClockTime time) const;
  /// Running time of the buffer (its DTS where it has one), no_time where there is none.
  std::int64_t time() const { return running_time(GST_BUFFER_DTS_OR_PTS(buffer)); }
  /// Running time at which the buffer ends, that of its begin where it has no length.
  std::int64_t end() const;
  /// Stream time of the buffer: what a GstController counts in.
  GstClockTime stream_time() const;
  /// Whether it stands for a GAP event.
  bool gap() const;
};

/// A pad's state; the type that pads with more to them derive from.
struct LivePadState {
  static constexpr char type_name[] = "PolyhullLivePad";
  static GType base_type() { return GST_TYPE_AGGREGATOR_PAD; }
  static void class_init(gpointer klass);
  explicit LivePadState(gpointer pad);
  ~LivePadState() { gst_clear_buffer(&front.buffer); }

  /// What looks at each buffer before all else, and may replace or drop it; null: nothing.
  GstPadProbeReturn (*entry)(GstPad*, GstPadProbeInfo*) = nullptr;
  /// By how much `entry` last moved a buffer's running time, ns: GAP events, which it does not see,
  /// are moved by as much, and what the source hears of running times is moved back.
  std::atomic<std::int64_t> shift{0};
  Arrival front;  ///< what peek() has shown, with a reference; the streaming thread's
  Punctuality punctuality;
  std::uint64_t told = 0;  ///< version of the pace that its source knows; the streaming thread's
  std::atomic<bool> flushed{false};  ///< set by the flushing thread: forget everything
  std::atomic<bool> begun{false};    ///< a buffer has come
  std::atomic<int> queued{0};        ///< buffers, without those of GAP events
  std::atomic<gint64> last_buffer{g_get_monotonic_time()};  ///< when one came, monotonic µs
  std::atomic<bool> said_silent{false};                     ///< the pad's silence has been said
};

/// References on an element's sink pads as they are now.
class Pads {
 public:
  explicit Pads(gpointer element);
  ~Pads();
  Pads(const Pads&) = delete;
  Pads& operator=(const Pads&) = delete;
  std::size_t size() const { return pads_.size(); }
  GstAggregatorPad* operator[](std::size_t i) const { return pads_[i]; }
  auto begin() const { return pads_.begin(); }
  auto end() const { return pads_.end(); }

 private:
  std::vector<GstAggregatorPad*> pads_;
};

/// What came first of what waits on \p pad, null: nothing. Valid until the next call for the pad.
/// The streaming thread's.
const Arrival* peek(GstAggregatorPad* pad);

/// Removes what came first; nothing where nothing waits.
void pop(GstAggregatorPad* pad);

/// Whether more than one buffer waits.
inline bool more_wait(GstAggregatorPad* pad) {
  return state_of<LivePadState>(pad).queued > 1;
}

/// Running time of \p element's clock now, ns; no_time where it has no clock or has not started.
std::int64_t running_time_now(GstElement* element);

/// The same for an element that is sought. After a flush the pipeline may set running time back,
/// when its sinks have got something: until then, a second at most, the clock says nothing.
class FlushedClock {
 public:
  explicit FlushedClock(GstElement* element) : element_(element) {}
  /// A flush has begun: see above.
  void flushed();
  void reset() { base_at_flush_ = GST_CLOCK_TIME_NONE; }
  /// Running time, ns; no_time where it is not known.
  std::int64_t now() const;

 private:
  GstElement* element_;
  std::atomic<GstClockTime> base_at_flush_{GST_CLOCK_TIME_NONE};
  std::atomic<gint64> flush_time_{0};  // monotonic µs
};

}  // namespace polyhull::element
