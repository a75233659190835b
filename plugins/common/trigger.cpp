// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/trigger.h"

#include "mesh/view.h"

namespace polyhull::element {
namespace {

GstCaps* trigger_caps() {
  static GstCaps* const caps = [] {
    GstCaps* made = gst_caps_new_empty_simple("timestamp/x-polyhull-trigger");
    GST_MINI_OBJECT_FLAG_SET(made, GST_MINI_OBJECT_FLAG_MAY_BE_LEAKED);
    return made;
  }();
  return caps;
}

std::int64_t absolute_time(GstElement* element, const GstSegment& segment, GstBuffer* buffer) {
  const GstClockTime stamp =
      GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer);
  if (!GST_CLOCK_TIME_IS_VALID(stamp) || segment.format != GST_FORMAT_TIME) return no_time;
  const GstClockTime running = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, stamp);
  if (!GST_CLOCK_TIME_IS_VALID(running)) return no_time;
  const GstClockTime base = gst_element_get_base_time(element);
  return static_cast<std::int64_t>(running + (GST_CLOCK_TIME_IS_VALID(base) ? base : 0));
}

}  // namespace

Capture capture_of(GstElement* element, const GstSegment& segment, GstBuffer* buffer,
                   bool use_offset) {
  Capture capture{no_trigger, no_time};
  const auto* meta = gst_buffer_get_reference_timestamp_meta(buffer, trigger_caps());
  if (meta != nullptr) {
    capture.trigger = meta->timestamp;
    if (GST_CLOCK_TIME_IS_VALID(meta->duration)) {
      capture.time = static_cast<std::int64_t>(meta->duration);
    }
  } else if (use_offset && GST_BUFFER_OFFSET_IS_VALID(buffer)) {
    capture.trigger = GST_BUFFER_OFFSET(buffer);
  }
  if (capture.time == no_time) capture.time = absolute_time(element, segment, buffer);
  return capture;
}

void attach_trigger(GstBuffer* buffer, std::uint64_t trigger, std::int64_t capture_time) {
  const GstClockTime duration =
      capture_time == no_time ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(capture_time);
  gst_buffer_add_reference_timestamp_meta(buffer, trigger_caps(), trigger, duration);
}

}  // namespace polyhull::element
