// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/takesink/take_times.h"

#include <algorithm>

namespace polyhull::element {
namespace {

constexpr std::int64_t lead = 10 * GST_SECOND;

}  // namespace

std::optional<TakeTimes::Time> TakeTimes::of(const GstSegment& segment, GstBuffer* buffer) {
  const GstClockTime stamp =
      GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer);
  const GstClockTime time = segment.format == GST_FORMAT_TIME
                                ? gst_segment_to_running_time(&segment, GST_FORMAT_TIME, stamp)
                                : GST_CLOCK_TIME_NONE;
  if (!GST_CLOCK_TIME_IS_VALID(time) || time > static_cast<GstClockTime>(G_MAXINT64 / 4))
    return std::nullopt;
  const auto running = static_cast<std::int64_t>(time);
  if (!origin_) origin_ = std::max<std::int64_t>(0, running - lead);
  return Time{std::max<std::int64_t>(0, running - *origin_), running < *origin_};
}

}  // namespace polyhull::element
