// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What elements on GstBaseTransform need and the base class does not do.
#pragma once

#include <gst/base/gstbasetransform.h>

namespace polyhull::element {

/// Adds a pad template that is always there.
inline void add_template(GstElementClass* klass, const char* name, GstPadDirection direction,
                         const char* caps) {
  GstCaps* parsed = gst_caps_from_string(caps);
  gst_element_class_add_pad_template(klass,
                                     gst_pad_template_new(name, direction, GST_PAD_ALWAYS, parsed));
  gst_caps_unref(parsed);
}

/// Sets the properties that a GstController drives to their values at \p buffer; for
/// GstBaseTransformClass::before_transform.
inline void sync_controlled_properties(GstBaseTransform* base, GstBuffer* buffer) {
  // A file's bytes have no time.
  if (base->segment.format != GST_FORMAT_TIME) return;
  const GstClockTime time =
      gst_segment_to_stream_time(&base->segment, GST_FORMAT_TIME, GST_BUFFER_TIMESTAMP(buffer));
  if (GST_CLOCK_TIME_IS_VALID(time)) gst_object_sync_values(GST_OBJECT_CAST(base), time);
}

}  // namespace polyhull::element
