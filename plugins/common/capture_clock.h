// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Capture times and timecodes that cameras and drivers attach to frames.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>

#include "mesh/view.h"

namespace polyhull::element {

/// Whether times of \p clock are of the pipeline's, whoever read them.
inline bool is_pipelines(CaptureClock clock) {
  return clock == CaptureClock::arrival || clock == CaptureClock::pipeline;
}

/// Takes the capture time (ns) and its clock from the first GstReferenceTimestampMeta of \p buffer
/// whose caps name a clock that several cameras may share: `timestamp/x-unix` and
/// `timestamp/x-ndi-timestamp` (since 1970 UTC), `timestamp/x-ntp` (since 1900 UTC, as
/// rtpjitterbuffer has it; becomes 1970's), `timestamp/x-ptp`. \p only: the first of that clock.
/// Leaves both alone where there is none.
void find_camera_time(GstBuffer* buffer, std::int64_t& time, CaptureClock& clock,
                      std::optional<CaptureClock> only = {});

/// The timecode of \p buffer's GstVideoTimeCodeMeta as ns since midnight, no_time where it has none
/// or one that is not valid.
std::int64_t timecode_of(GstBuffer* buffer);

}  // namespace polyhull::element
