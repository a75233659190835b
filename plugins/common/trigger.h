// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How the number of the trigger pulse that a frame answers to, and the frame's capture time,
/// travel with video frames. Views carry both in their payload; in front of contourfind they are
/// found on the buffer, in this order:
///  1. a GstReferenceTimestampMeta whose reference caps are `timestamp/x-polyhull-trigger`: its
///     timestamp is the trigger number, its duration (if valid) the capture time;
///  2. a GstReferenceTimestampMeta with other caps is a clock of its own and is not used;
///  3. GST_BUFFER_OFFSET only where the caller asks for it: most sources that set it (v4l2src,
///     videotestsrc) count their own frames there, each camera from its own start.
/// The capture time is otherwise base time + running time, the pipeline clock's absolute time.
#pragma once

#include <gst/gst.h>

#include <cstdint>

namespace polyhull::element {

/// What is known of the instant a frame was taken.
struct Capture {
  std::uint64_t trigger;  ///< polyhull::no_trigger where unknown
  std::int64_t time;      ///< ns, polyhull::no_time where unknown
};

/// Trigger number and capture time of \p buffer, which \p element receives within \p segment.
/// \p use_offset: whether GST_BUFFER_OFFSET counts as a trigger number.
Capture capture_of(GstElement* element, const GstSegment& segment, GstBuffer* buffer,
                   bool use_offset);

/// Writes the trigger number, and the capture time unless it is no_time, onto \p buffer (writable).
void attach_trigger(GstBuffer* buffer, std::uint64_t trigger, std::int64_t capture_time);

}  // namespace polyhull::element
