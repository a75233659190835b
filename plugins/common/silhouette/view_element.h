// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What contourfind and silhouette, the two elements that make views, do alike.
#pragma once

#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include "mesh/view.h"
#include "plugins/common/silhouette/contour_properties.h"
#include "plugins/common/silhouette/tolerance_control.h"
#include "plugins/common/statistics.h"

namespace polyhull::element {

/// For GstBaseTransformClass::transform_caps: any video that the sink pad takes becomes views of
/// the same frame rate.
GstCaps* view_transform_caps(GstBaseTransform* base, GstPadDirection direction, GstCaps* caps,
                             GstCaps* filter);

/// Camera name, trigger number, capture time and size of the frame that \p base transforms.
void begin_view(GstBaseTransform* base, const ContourValues& values, const GstVideoFrame& frame,
                View& view);

/// The tolerance to use now.
double tolerance_of(const ContourValues& values, const ToleranceControl& control);

extern const char* const contour_statistics_blurb;

/// Makes the contours' entries appear in `stats`.
void declare_contour_statistics(Statistics& statistics);

/// Counts one frame.
void report_contours(Statistics& statistics, const ApproximateCounts& counts, bool reused,
                     double tolerance);

}  // namespace polyhull::element
