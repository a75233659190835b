// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any text as that of a caps or a segment packet. The first byte tells which, and
// whether the text has the begin of a good one.
#include <gst/gst.h>

#include <cstdlib>
#include <string>

#include "plugins/viewclientsrc/packets.h"

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  gst_init(count, arguments);
  // What GStreamer says of bad text would be all that is seen.
  gst_debug_set_default_threshold(GST_LEVEL_NONE);
  g_log_set_default_handler([](const gchar*, GLogLevelFlags, const gchar*, gpointer) {}, nullptr);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace polyhull::element;
  if (size == 0 || size > longest_text) return 0;
  std::string text(reinterpret_cast<const char*>(data + 1), size - 1);
  text = text.substr(0, text.find('\0'));
  if (data[0] & 1) {
    if (data[0] & 2) text.insert(0, "application/x-polyhull-view, ");
    GstCaps* caps = read_caps(text);
    if (caps == nullptr) return 0;
    if (!gst_caps_is_fixed(caps)) std::abort();
    gst_caps_unref(caps);
  } else {
    if (data[0] & 2)
      text.insert(0,
                  "GstEventSegment, segment=(GstSegment)\"GstSegment, flags=(GstSegmentFlags)none, "
                  "rate=(double)1, applied-rate=(double)1, format=(GstFormat)time, ");
    GstSegment segment;
    if (!read_segment(text, segment)) return 0;
    if (segment.format != GST_FORMAT_TIME || !(segment.rate > 0.0)) std::abort();
    gst_segment_to_running_time(&segment, GST_FORMAT_TIME, 40 * GST_MSECOND);
  }
  return 0;
}
