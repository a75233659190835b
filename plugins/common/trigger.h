// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How the number of the trigger pulse that a frame answers to, and the frame's capture time,
/// travel with video frames. Views carry both in their payload; in front of contourfind they are
/// found on the buffer, in this order:
///  1. a GstReferenceTimestampMeta whose reference caps are `timestamp/x-polyhull-trigger`: its
///     timestamp is the trigger number, its duration (if valid) the capture time;
///  2. a GstReferenceTimestampMeta with `timestamp/x-unix`, `x-ntp`, `x-ndi-timestamp` or `x-ptp` is
///     a capture time of the camera's own (plugins/common/capture_clock.h); one with other caps is a
///     clock that nobody else shares and is not used;
///  3. GST_BUFFER_OFFSET only where the caller asks for it: most sources that set it (v4l2src,
///     videotestsrc) count their own frames there, each camera from its own start.
/// The capture time is otherwise base time + running time, the pipeline clock's absolute time when
/// the frame came. A GstVideoTimeCodeMeta gives the timecode.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <memory>
#include <string>

#include "trigger/pulse_table.h"

#include "mesh/view.h"

namespace polyhull::element {

/// What is known of the instant a frame was taken.
struct Capture {
  std::uint64_t trigger = no_trigger;
  std::int64_t time = no_time;  ///< ns
  CaptureClock clock = CaptureClock::arrival;
  std::int64_t on_pipeline_clock = no_time;  ///< ns: `time` where it is of that, else the arrival
  std::int64_t timecode = no_time;           ///< ns since midnight
};

/// Trigger number and capture time of \p buffer, which \p element receives within \p segment.
/// \p use_offset: whether GST_BUFFER_OFFSET counts as a trigger number.
Capture capture_of(GstElement* element, const GstSegment& segment, GstBuffer* buffer,
                   bool use_offset);

/// Writes the trigger number, and the capture time unless it is no_time, onto \p buffer (writable),
/// in the place of what was written before; no_trigger leaves the frame without either.
void attach_trigger(GstBuffer* buffer, std::uint64_t trigger, std::int64_t capture_time);

/// Makes the pulses of the trigger \p element known to find_pulses().
void publish_pulses(GstElement* element, const std::shared_ptr<PulseTable>& pulses);

/// The pulses of the trigger in the pipeline of \p seeker: of the element \p name, or with an empty
/// name of the only one there. Throws Error where there is none, or more.
std::shared_ptr<const PulseTable> find_pulses(GstElement* seeker, const std::string& name);

}  // namespace polyhull::element
