// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What elements on GstBaseTransform need and the base class does not do.
#pragma once

#include <gst/base/gstbasetransform.h>

#include "plugins/common/element.h"
#include "plugins/common/live/live_pace.h"

namespace polyhull::element {

/// Sets the properties that a GstController drives to their values at \p buffer; for
/// GstBaseTransformClass::before_transform.
inline void sync_controlled_properties(GstBaseTransform* base, GstBuffer* buffer) {
  // A file's bytes have no time.
  if (base->segment.format != GST_FORMAT_TIME) return;
  const GstClockTime time =
      gst_segment_to_stream_time(&base->segment, GST_FORMAT_TIME, GST_BUFFER_TIMESTAMP(buffer));
  if (GST_CLOCK_TIME_IS_VALID(time)) gst_object_sync_values(GST_OBJECT_CAST(base), time);
}

/// prepare_output_buffer of an element that changes what is beside the pixels: the buffer itself, or
/// where others hold it, another one of the same memory.
inline GstFlowReturn writable_output(GstBaseTransform*, GstBuffer* in, GstBuffer** out) {
  *out = gst_buffer_is_writable(in) ? in : gst_buffer_copy(in);
  return GST_FLOW_OK;
}

/// Has prepare_output_buffer() do all that the element does: there the output's size is known.
inline void leave_nothing_to_transform(GstBaseTransformClass* klass) {
  klass->transform = [](GstBaseTransform*, GstBuffer*, GstBuffer*) { return GST_FLOW_OK; };
  klass->transform_size = [](GstBaseTransform*, GstPadDirection, GstCaps*, gsize size, GstCaps*,
                             gsize* other) -> gboolean {
    *other = size;
    return TRUE;
  };
  klass->passthrough_on_same_caps = FALSE;
}

/// submit_input_buffer of an element with a `pace`: leaves out the frames that nobody wants.
template <class State>
GstFlowReturn submit_input_buffer(GstBaseTransform* base, gboolean discontinuous,
                                  GstBuffer* input) {
  State& self = state_of<State>(base);
  return submit_wanted(base, self.pace, self.statistics,
                       GST_BASE_TRANSFORM_CLASS(parent_class<State>()), discontinuous, input);
}

/// src_event of an element that hears of the pace, or has a function `observe` for what it wants to
/// know of events.
template <class State>
gboolean src_event(GstBaseTransform* base, GstEvent* event) {
  State& self = state_of<State>(base);
  if constexpr (requires { self.pace; }) {
    PaceChange change;
    if (parse_pace_event(event, change)) self.pace.hear(change);
  }
  if constexpr (requires { self.observe(base, event); }) self.observe(base, event);
  return GST_BASE_TRANSFORM_CLASS(parent_class<State>())->src_event(base, event);
}

}  // namespace polyhull::element
