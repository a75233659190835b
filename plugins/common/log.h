// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The debug log, as GST_DEBUG=NAME:6 prints it: at LOG what became of each buffer, at DEBUG what
/// was decided. An element logs in a category of its own name with GST_LOG_OBJECT and
/// GST_DEBUG_OBJECT; where it has several sources, the header that they share has
///
///     GST_DEBUG_CATEGORY_EXTERN(blur_debug);
///     #define GST_CAT_DEFAULT blur_debug
///
/// Sources that elements share log in the category of the element that they work for:
///
///     GST_CAT_LOG_OBJECT(category_of(pad), pad, "%" GST_PTR_FORMAT " comes", printed(buffer));
///
/// These macros evaluate their arguments only while some category logs at their level.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <string>

namespace polyhull::element {

/// The debug category of the element that \p object is, or whose pad it is; GStreamer's default
/// category where there is none.
GstDebugCategory* category_of(gpointer object);

/// \p object (a buffer, caps, an event) as GST_PTR_FORMAT takes it.
inline gpointer printed(gconstpointer object) {
  return const_cast<gpointer>(object);
}

/// \p time, ns, as GST_TIME_ARGS takes it; negative: none.
inline GstClockTime clock_time(std::int64_t time) {
  return time < 0 ? GST_CLOCK_TIME_NONE : static_cast<GstClockTime>(time);
}

/// \p time, ns, as GST_TIME_FORMAT prints it; negative: 99:99:99.999999999.
std::string time_text(std::int64_t time);

/// Logs at DEBUG that the property of \p spec of \p object was set to \p value.
void log_property(GObject* object, const GValue* value, const GParamSpec* spec);

}  // namespace polyhull::element
