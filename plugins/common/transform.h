// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What elements on GstBaseTransform need and the base class does not do.
#pragma once

#include <gst/base/gstbasetransform.h>

#include "plugins/common/element.h"

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

}  // namespace polyhull::element
