// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/view_element.h"

#include <algorithm>
#include <utility>

#include "plugins/common/log.h"
#include "plugins/common/trigger.h"

namespace polyhull::element {
namespace {

constexpr double largest_tolerance = 100.0;  // px, what the approximation takes

/// The caps of the views made from video of \p video: they keep its frame rate, if it has one.
GstCaps* view_caps_of(const GstCaps* video) {
  GstCaps* caps = gst_caps_new_empty_simple(view_caps);
  const GstStructure* structure =
      gst_caps_get_size(video) > 0 ? gst_caps_get_structure(video, 0) : nullptr;
  const GValue* rate =
      structure != nullptr ? gst_structure_get_value(structure, "framerate") : nullptr;
  if (rate != nullptr) gst_caps_set_value(caps, "framerate", rate);
  return caps;
}

}  // namespace

void ToleranceControl::set_stream_rate(int numerator, int denominator) {
  const std::scoped_lock lock(mutex_);
  stream_rate_ =
      numerator > 0 && denominator > 0 ? static_cast<double>(numerator) / denominator : 0.0;
}

void ToleranceControl::observe(GstEvent* qos, double target_rate) {
  GstQOSType type;
  gdouble proportion = 0.0;
  GstClockTimeDiff difference = 0;
  GstClockTime timestamp = GST_CLOCK_TIME_NONE;
  gst_event_parse_qos(qos, &type, &proportion, &difference, &timestamp);
  // A sink that throttles on purpose says nothing about the time there is.
  if (type == GST_QOS_TYPE_THROTTLE || !GST_CLOCK_TIME_IS_VALID(timestamp)) return;
  const std::scoped_lock lock(mutex_);
  double load = proportion;
  if (target_rate > 0.0 && stream_rate_ > 0.0) load *= target_rate / stream_rate_;
  adaptive_.observe(load, static_cast<std::int64_t>(timestamp));
}

double ToleranceControl::tolerance(double base) const {
  const std::scoped_lock lock(mutex_);
  return adaptive_.tolerance(base);
}

void ToleranceControl::reset() {
  const std::scoped_lock lock(mutex_);
  adaptive_.reset();
}

GstCaps* view_transform_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                             GstCaps* filter) {
  return filtered(direction == GST_PAD_SINK
                      ? view_caps_of(caps)
                      : gst_pad_get_pad_template_caps(GST_BASE_TRANSFORM_SINK_PAD(base)),
                  filter);
}

bool ViewElement::set_format(GstBaseTransform* base, const GstCaps* caps) {
  if (!video_info_of(caps, &info)) return false;
  GST_CAT_DEBUG_OBJECT(category_of(base), base, "takes %" GST_PTR_FORMAT, printed(caps));
  control.set_stream_rate(GST_VIDEO_INFO_FPS_N(&info), GST_VIDEO_INFO_FPS_D(&info));
  return true;
}

void ViewElement::observe(GstBaseTransform* base, GstEvent* event) {
  if (GST_EVENT_TYPE(event) != GST_EVENT_QOS) return;
  const ContourValues values = snapshot(base, contour);
  if (values.adaptive) control.observe(event, values.target_rate);
}

void ViewElement::begin_view(GstBaseTransform* base, const ContourValues& values,
                             const GstVideoFrame& frame) {
  Rings contours = std::move(view.contours);
  contours.clear();
  view = View();
  view.contours = std::move(contours);
  view.camera = values.camera.empty() ? GST_OBJECT_NAME(base) : values.camera;
  view.width = GST_VIDEO_FRAME_WIDTH(&frame);
  view.height = GST_VIDEO_FRAME_HEIGHT(&frame);
  const Capture capture = capture_of(GST_ELEMENT_CAST(base), base->segment, frame.buffer,
                                     values.trigger == TriggerSource::offset);
  view.trigger = values.trigger == TriggerSource::none ? no_trigger : capture.trigger;
  view.capture_time = capture.time;
  view.clock = capture.clock;
  view.timecode = capture.timecode;
}

double ViewElement::tolerance_of(const ContourValues& values) const {
  if (!values.adaptive) return values.tolerance;
  return std::min(control.tolerance(values.tolerance), largest_tolerance);
}

const char* const contour_statistics_blurb =
    "Counters since the element started: frames, frames without foreground, frames that took over "
    "the contours of the one before because they equal it, others whose contours stayed by "
    "steadiness, and of the last frame the rings and points traced, the rings "
    "and points sent, the rings dropped, and the tolerance used in pixels.";

void declare_contour_statistics(Statistics& statistics) {
  statistics.declare({"frames", "empty", "reused", "steady", "traced-rings", "traced-points",
                      "rings", "points", "dropped-rings", "crossings"});
  statistics.set("tolerance", 0.0);
}

void ViewElement::report_contours(Statistics& statistics, const ApproximateCounts& counts,
                                  Unchanged same, double tolerance) {
  unchanged = same;
  statistics.count("frames");
  statistics.count("empty", counts.rings == 0 ? 1 : 0);
  statistics.count("reused", same.frame ? 1 : 0);
  statistics.count("steady", same.contours ? 1 : 0);
  statistics.set_count("traced-rings", counts.traced_rings);
  statistics.set_count("traced-points", counts.traced_points);
  statistics.set_count("rings", counts.rings);
  statistics.set_count("points", counts.points);
  statistics.set_count("dropped-rings", counts.dropped_rings);
  statistics.set_count("crossings", counts.crossings);
  statistics.set("tolerance", tolerance);
}

void ViewElement::log_view(GstBaseTransform* base, GstBuffer* frame) const {
  GST_CAT_LOG_OBJECT(
      category_of(base), base,
      "view of %s: %zu rings of %zu points%s, %zu bytes of pixels, of %" GST_PTR_FORMAT,
      view.camera.c_str(), view.contours.size(), view.contours.points.size(),
      unchanged.frame      ? " (the frame before, used again)"
      : unchanged.contours ? " (steady)"
                           : "",
      view.pixels.size(), printed(frame));
}

}  // namespace polyhull::element
