// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What contourfind and silhouette, the two elements that make views, do alike.
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <mutex>

#include "mesh/view.h"
#include "plugins/common/guard.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/memory/video_frame.h"
#include "plugins/common/silhouette/contour_properties.h"
#include "plugins/common/transform.h"
#include "silhouette/contour/adaptive_tolerance.h"

namespace polyhull::element {

/// The property `adaptive`: QoS events from downstream steer the polygon tolerance. Any thread.
class ToleranceControl {
 public:
  /// The frame rate of the stream; 0/1 where it is not known.
  void set_stream_rate(int numerator, int denominator);

  /// Takes the load out of a QoS event. Its proportion is the time the slowest element took for a
  /// buffer over the time between two buffers of the stream. At a target below the stream's rate
  /// some frames may be late, and at a target above it all must be early. \p target_rate: 0 is the
  /// stream's.
  void observe(GstEvent* qos, double target_rate);

  /// The tolerance to use now for the user's \p base, both in px; may be above what the
  /// approximation takes.
  double tolerance(double base) const;
  void reset();

 private:
  mutable std::mutex mutex_;  // protects all below
  AdaptiveTolerance adaptive_;
  double stream_rate_ = 0.0;
};

/// What a frame did not change.
struct Unchanged {
  bool frame = false;     ///< the frame itself, so that its contours were not looked for
  bool contours = false;  ///< its contours, by their steadiness
};

/// What the states of both hold.
struct ViewElement {
  ViewElement() { gst_video_info_init(&info); }

  /// Takes over the input's format and frame rate; false: \p caps are no video.
  bool set_format(GstBaseTransform* base, const GstCaps* caps);
  /// Learns from QoS events what the tolerance has to be.
  void observe(GstBaseTransform* base, GstEvent* event);
  /// The tolerance to use now, px, within what the approximation takes.
  double tolerance_of(const ContourValues& values) const;
  /// Makes camera name, trigger number, capture time and size of `view` those of \p frame.
  void begin_view(GstBaseTransform* base, const ContourValues& values, const GstVideoFrame& frame);
  /// Counts one frame, and notes what of it is \p same as before.
  void report_contours(Statistics& statistics, const ApproximateCounts& counts, Unchanged same,
                       double tolerance);
  /// Logs the view that was made of \p frame.
  void log_view(GstBaseTransform* base, GstBuffer* frame) const;

  ContourValues contour;  // under the object lock

  ToleranceControl control;
  GstVideoInfo info;  // the rest belongs to the streaming thread
  ViewWriter writer;
  View view;            // that of the last frame; its memory is used again
  Unchanged unchanged;  // of that frame
};

/// What `stats` of contourfind holds.
extern const char* const contour_statistics_blurb;

/// Makes the contours' entries appear in `stats`.
void declare_contour_statistics(Statistics& statistics);

/// For GstBaseTransformClass::transform_caps: any video that the sink pad takes becomes views of
/// the same frame rate.
GstCaps* view_transform_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                             GstCaps* filter);

/// The virtual functions of an element whose State is a ViewElement and has a function
/// `GstBuffer* make_view(GstBaseTransform*, const GstVideoFrame&)`.
template <class State>
void install_view_element(gpointer klass) {
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->transform_caps = view_transform_caps;
  base_class->propose_allocation = [](GstBaseTransform* base, GstQuery* decide, GstQuery* query) {
    GstCaps* caps = nullptr;
    gst_query_parse_allocation(query, &caps, nullptr);
    // Metas know no strides of a mosaic.
    if (caps == nullptr || !is_mosaic(caps))
      gst_query_add_allocation_meta(query, GST_VIDEO_META_API_TYPE, nullptr);
    return GST_BASE_TRANSFORM_CLASS(parent_class<State>())->propose_allocation(base, decide, query);
  };
  base_class->before_transform = sync_controlled_properties;
  base_class->prepare_output_buffer = [](GstBaseTransform* base, GstBuffer* in, GstBuffer** out) {
    State& self = state_of<State>(base);
    return guarded(GST_ELEMENT_CAST(base), GST_FLOW_ERROR, [&]() -> GstFlowReturn {
      const MappedFrame frame(self.info, in);
      *out = self.make_view(base, frame.frame());
      self.log_view(base, in);
      return GST_FLOW_OK;
    });
  };
  leave_nothing_to_transform(base_class);
  base_class->src_event = src_event<State>;
}

}  // namespace polyhull::element
