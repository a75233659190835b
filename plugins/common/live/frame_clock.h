// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Which frame a source of video makes next, when it leaves, and what it leaves out.
///
/// Frame n of a stream of r frames per second has the time n / r, whenever the source was started:
/// so all sources of a pipeline have one grid. A live source sends frame n when running time has
/// got there; one that is late leaves frames out, at frame numbers that its neighbours meet, too.
/// Time stamps are never shifted: GstBaseSrc would add to all of them what the first frame took.
#pragma once

#include <gst/base/gstbasesrc.h>
#include <gst/video/video.h>

#include <cstdint>
#include <mutex>
#include <utility>

#include "live/frame_grid.h"
#include "live/lateness_window.h"
#include "plugins/common/live/live_pace.h"
#include "plugins/common/live/live_pad.h"

namespace polyhull::element {

class FrameClock {
 public:
  /// What a source is to make.
  struct Frame {
    std::uint64_t number = 0;
    GstClockTime time = 0;      ///< of the stream: its PTS
    GstClockTime duration = 0;  ///< ns
    std::uint64_t late = 0;     ///< frames before it that were left out because it was too late
    std::uint64_t unwanted = 0; ///< ... because nobody downstream keeps up with them
  };

  /// How late each frame leaves, as a real camera's does, ns: delay ± jitter, drawn from seed.
  struct Delay {
    std::uint64_t delay = 0, jitter = 0;
    std::uint64_t seed = 0;
    std::int64_t of(std::uint64_t number) const;
  };

  explicit FrameClock(GstBaseSrc* source) : source_(source), clock_(GST_ELEMENT_CAST(source)) {}

  /// From the start on: rate unknown, frame 0.
  void reset();

  /// Takes the frame rate over, which is above 0; a new one goes on at the same time.
  void set_rate(int numerator, int denominator);

  /// Goes to segment->position. False: \p segment runs backwards.
  bool seek(GstSegment* segment);

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
  GstClockTime time_of(std::uint64_t number) const;
  std::int64_t running_time_of(std::uint64_t number) const;
  void report(std::int64_t now, std::int64_t late);

  GstBaseSrc* source_;
  FlushedClock clock_;
  mutable std::mutex mutex_;  // protects all below
  int rate_n_ = 0, rate_d_ = 1;
  std::uint64_t next_ = 0;
  GstClockTime sought_ = 0;  // before the rate was known
  bool first_ = true;        // no frame has been made yet
  bool unsynced_ = true;     // no frame has been through get_times() yet
  Delay delay_;
  FrameGrids grids_;
  LatenessWindow lateness_;  // of frames that were not ready when they were due
  std::int64_t reported_ = 0;
};

}  // namespace polyhull::element
