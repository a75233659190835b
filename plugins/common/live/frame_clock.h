// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A FrameSchedule on the clock of a GstBaseSrc: when a live source sends its frames, and the
/// latency that follows. Time stamps are never shifted: GstBaseSrc would add to all of them what
/// the first frame took.
#pragma once

#include <gst/base/gstbasesrc.h>
#include <gst/video/video.h>

#include <cstdint>
#include <mutex>
#include <utility>

#include "live/frame_schedule.h"
#include "live/lateness_window.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/live/live_pad.h"

namespace polyhull::element {

/// When one source makes which frame. Any thread.
class FrameClock {
 public:
  using Frame = FrameSchedule::Frame;
  using Delay = FrameDelay;

  explicit FrameClock(GstBaseSrc* source) : source_(source), clock_(GST_ELEMENT_CAST(source)) {}

  /// From the start on: rate unknown, frame 0.
  void reset();

  /// Takes the frame rate over, which is above 0; a new one goes on at the same time.
  void set_rate(int numerator, int denominator);

  /// Goes to segment->position. False: \p segment runs backwards.
  bool seek(GstSegment* segment);

  /// How late frames leave from now on; posts a LATENCY message where the latency changes.
  void set_delay(const Delay& delay);

  /// The frame to make now.
  Frame next();

  /// Stamps \p buffer as \p frame and moves on to the one after.
  void finish(const Frame& frame, GstBuffer* buffer);

  /// Running time at which \p frame leaves, ns; GST_CLOCK_TIME_NONE where the source is not live.
  GstClockTime due(const Frame& frame) const;

  /// Virtual functions of GstBaseSrc.
  void get_times(GstBuffer* buffer, GstClockTime* begin, GstClockTime* end);
  bool answer_latency(GstQuery* query);
  /// Whether \p event told of a pace.
  bool hear(GstEvent* event);

 private:
  std::int64_t running_time_of(std::uint64_t number) const;
  void report(std::int64_t now, std::int64_t late);

  GstBaseSrc* source_;
  FlushedClock clock_;
  mutable std::mutex mutex_;  // protects all below
  FrameSchedule schedule_;
  bool unsynced_ = true;  // no frame has been through get_times() yet
  Delay delay_;
  FrameGrids grids_;
  LatenessWindow lateness_;  // of frames that were not ready when they were due
  std::int64_t reported_ = 0;
};

}  // namespace polyhull::element
