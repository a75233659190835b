// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/trigger.h"

#include "plugins/common/capture_clock.h"
#include "plugins/common/pipeline.h"

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

/// \p time, ns; no_time where a view cannot have it.
std::int64_t known(GstClockTime time) {
  return time <= static_cast<GstClockTime>(latest_time) ? static_cast<std::int64_t>(time) : no_time;
}

std::int64_t absolute_time(GstElement* element, const GstSegment& segment, GstBuffer* buffer) {
  const GstClockTime stamp =
      GST_BUFFER_PTS_IS_VALID(buffer) ? GST_BUFFER_PTS(buffer) : GST_BUFFER_DTS(buffer);
  if (!GST_CLOCK_TIME_IS_VALID(stamp) || segment.format != GST_FORMAT_TIME) return no_time;
  const GstClockTime running = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, stamp);
  if (!GST_CLOCK_TIME_IS_VALID(running)) return no_time;
  const GstClockTime base = gst_element_get_base_time(element);
  return known(running) == no_time ? no_time
                                   : known(running + (GST_CLOCK_TIME_IS_VALID(base) ? base : 0));
}

using Pulses = std::shared_ptr<PulseTable>;

GQuark pulses_quark() {
  static const GQuark quark = g_quark_from_static_string("polyhull-pulses");
  return quark;
}

Pulses* pulses_of(GstElement* element) {
  return static_cast<Pulses*>(g_object_get_qdata(G_OBJECT(element), pulses_quark()));
}

}  // namespace

Capture capture_of(GstElement* element, const GstSegment& segment, GstBuffer* buffer,
                   bool use_offset) {
  Capture capture;
  capture.timecode = timecode_of(buffer);
  const auto* meta = gst_buffer_get_reference_timestamp_meta(buffer, trigger_caps());
  if (meta != nullptr) {
    capture.trigger = meta->timestamp;
    capture.time = known(meta->duration);
    if (capture.time != no_time) capture.clock = CaptureClock::pipeline;
  } else if (use_offset && GST_BUFFER_OFFSET_IS_VALID(buffer)) {
    capture.trigger = GST_BUFFER_OFFSET(buffer);
  }
  if (capture.time == no_time) find_camera_time(buffer, capture.time, capture.clock);
  const bool arrival = capture.time == no_time;
  if (arrival) capture.time = absolute_time(element, segment, buffer);
  capture.on_pipeline_clock = arrival || is_pipelines(capture.clock)
                                  ? capture.time
                                  : absolute_time(element, segment, buffer);
  return capture;
}

void attach_trigger(GstBuffer* buffer, std::uint64_t trigger, std::int64_t capture_time) {
  while (auto* old = gst_buffer_get_reference_timestamp_meta(buffer, trigger_caps()))
    gst_buffer_remove_meta(buffer, &old->parent);
  if (trigger == no_trigger) return;
  const GstClockTime duration =
      capture_time == no_time ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(capture_time);
  gst_buffer_add_reference_timestamp_meta(buffer, trigger_caps(), trigger, duration);
}

void publish_pulses(GstElement* element, const Pulses& pulses) {
  g_object_set_qdata_full(G_OBJECT(element), pulses_quark(), new Pulses(pulses),
                          [](gpointer held) { delete static_cast<Pulses*>(held); });
}

std::shared_ptr<const PulseTable> find_pulses(GstElement* seeker, const std::string& name) {
  return *pulses_of(
      find_in_pipeline(seeker, name, "trigger", "serialtrigger", [](GstElement* element) {
        return pulses_of(element) != nullptr;
      }).get());
}

}  // namespace polyhull::element
