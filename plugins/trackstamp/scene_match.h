// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How another program's announcements and the frames of its video find each other.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "plugins/common/property_table.h"
#include "scene/timed_announcement.h"

namespace polyhull::element {

/// By what a message finds its frame.
enum class SceneMatch {
  timecode,     ///< GstVideoTimeCodeMeta
  clock,        ///< GstReferenceTimestampMeta since 1970
  stream_time,  ///< from the begin of the video
  arrival,      ///< the running time at which the message came
};
template <>
GType enum_type<SceneMatch>();

struct SceneInputSettings {
  SceneMatch match = SceneMatch::timecode;
  std::int64_t delay = 0;                 ///< ns; messages hold that much later than they say
  std::uint64_t wait = 40 * GST_MSECOND;  ///< ns; how long a frame of live video waits for its own
  std::string file;                       ///< in the place of the scene's name; empty: that counts
};

/// One row per property of SceneInputSettings.
std::span<const Property<SceneInputSettings>> scene_input_properties();

/// The time from which on \p message holds, ns; \p arrival: when it came, running time. Sets
/// \p period to that of AnnouncementHistory. Throws Error where it does not tell.
std::int64_t time_of_message(const TimedAnnouncement& message, SceneMatch match,
                             std::optional<std::int64_t> arrival, std::int64_t& period);

/// The time of \p frame, of \p segment, on the same clock; none where it does not tell.
std::optional<std::int64_t> time_of_frame(GstBuffer* frame, const GstSegment& segment,
                                          SceneMatch match);

/// Whether the count of \p frame's timecodes leaves numbers out.
bool drops_timecodes(GstBuffer* frame);

/// After which that clock begins at 0 again, ns; 0: never, or \p frame does not tell.
std::int64_t period_of_frame(GstBuffer* frame, SceneMatch match);

/// What to say of a frame without one: "has no ...".
const char* missing_in_frames(SceneMatch match);

}  // namespace polyhull::element
