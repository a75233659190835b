// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Times for the frames of aravissrc. By itself it begins at 0 with each camera's first frame; with
/// do-timestamp=true a frame has the time at which it was fetched, which is up to a frame late for the
/// first and for all that waited while the machine was busy.
#pragma once

#include <gst/gst.h>

#include <algorithm>

namespace polyhull::test {

/// Puts a camera's own times onto the pipeline's clock: by the least delay between them and the
/// frames' arrival. The camera's clock may run 100 ppm fast or slow. Frames of the first half second, in
/// which that delay is not known yet, are dropped.
class SteadyTimes {
 public:
  /// Works on the frames that \p pad, an aravissrc's, sends; must live as long.
  void watch(GstPad* pad) {
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, frame_comes, this, nullptr);
  }

 private:
  static constexpr GstClockTimeDiff unknown = G_MAXINT64;

  static GstPadProbeReturn frame_comes(GstPad* pad, GstPadProbeInfo* info, gpointer data) {
    auto& self = *static_cast<SteadyTimes*>(data);
    GstElement* source = gst_pad_get_parent_element(pad);
    const GstClockTime arrival = gst_element_get_current_running_time(source);
    gst_object_unref(source);
    GstBuffer* buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
    info->data = buffer;
    const GstClockTime time = GST_BUFFER_PTS(buffer);
    const GstClockTimeDiff delay = GST_CLOCK_DIFF(time, arrival);
    const GstClockTimeDiff drift = static_cast<GstClockTimeDiff>(time - self.last_) / 10000;
    self.delay_ = self.delay_ == unknown ? delay : std::min(self.delay_ + drift, delay);
    self.last_ = time;
    if (time < GST_SECOND / 2) return GST_PAD_PROBE_DROP;
    GST_BUFFER_PTS(buffer) = time + static_cast<GstClockTime>(self.delay_);
    GST_BUFFER_DTS(buffer) = GST_CLOCK_TIME_NONE;
    return GST_PAD_PROBE_OK;
  }

  GstClockTimeDiff delay_ = unknown;
  GstClockTime last_ = 0;
};

}  // namespace polyhull::test
