// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A controller for an element under test.
#pragma once

#include <gst/controller/gstdirectcontrolbinding.h>
#include <gst/controller/gstinterpolationcontrolsource.h>

#include "element_test.h"

namespace polyhull::test {

/// Lets \p property of \p object go from \p first, at time 0, to \p last, at \p time: by \p mode.
inline void control(gpointer object, const char* property, double first, double last,
                    GstClockTime time, GstInterpolationMode mode = GST_INTERPOLATION_MODE_LINEAR) {
  GstControlSource* source = gst_interpolation_control_source_new();
  g_object_set(source, "mode", mode, nullptr);
  auto* values = GST_TIMED_VALUE_CONTROL_SOURCE(source);
  gst_timed_value_control_source_set(values, 0, first);
  gst_timed_value_control_source_set(values, time, last);
  fail_unless(gst_object_add_control_binding(
      GST_OBJECT(object),
      gst_direct_control_binding_new_absolute(GST_OBJECT(object), property, source)));
  gst_object_unref(source);
}

}  // namespace polyhull::test
