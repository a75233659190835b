// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/hullbuild/entry.h"

#include <cstdlib>
#include <optional>

#include "base/error.h"
#include "plugins/common/memory/payload_buffer.h"
#include "plugins/hullbuild/private.h"
#include "wire/view_payload.h"

namespace polyhull::element {
namespace {

/// Running times of more than 31 years are nobody's.
constexpr std::int64_t latest_running = 1'000'000'000'000'000'000;

/// Its times; none where the bytes are no view: that is said when they are looked at.
std::optional<View> times_of(GstBuffer* buffer) {
  try {
    return read_view_times(MappedBuffer(buffer).segments());
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::string camera_of(gpointer pad) {
  const std::string name = snapshot(pad, state_of<HullPadState>(pad).name);
  return name.empty() ? GST_OBJECT_NAME(pad) : name;
}

void say_jump(HullBuild& self, GstPad* pad, std::int64_t jump) {
  ++state_of<HullPadState>(pad).jumps;
  self.statistics.warn(
      GST_ELEMENT_CAST(self.element), "clock-jumps",
      fmt::format("The clock of camera {} has jumped by {:+.3f} s. Its views go on being matched "
                  "as if it had not; look at what sets it (PTP, NTP, a timecode generator).",
                  camera_of(pad), 1e-9 * static_cast<double>(jump)));
}

void say_drift(HullBuild& self, GstPad* pad, double drift) {
  self.statistics.warn(
      GST_ELEMENT_CAST(self.element), "clock-drifts",
      fmt::format("The clock of camera {} runs {:.0f} millionths {} than the other cameras'. Its "
                  "capture times are corrected by when its views come, which is as exact as their "
                  "way is steady. Let it follow the others' clock (PTP, NTP, GstNetClientClock).",
                  camera_of(pad), std::abs(drift), drift > 0 ? "faster" : "slower"));
}

void say_apart(HullBuild& self, GstPad* pad, const Instants::Apart& apart) {
  std::string other = "another";  // where its pad has been released meanwhile
  for (GstAggregatorPad* each : Pads(self.element))
    if (each == apart.from) other = camera_of(each);
  self.statistics.warn(
      GST_ELEMENT_CAST(self.element), "clocks-apart",
      fmt::format("The clocks of cameras {} and {} tell times that are {:.1f} s apart when their "
                  "views come: nobody has set them to each other. Views are matched by running "
                  "time instead, which holds only for branches of one pipeline. Share a clock "
                  "(PTP, NTP, GstNetClientClock), a timecode or a trigger.",
                  camera_of(pad), other, 1e-9 * static_cast<double>(std::abs(apart.difference))));
}

/// Whether a buffer of \p segment can have the running time \p time, ns.
bool reaches(GstSegment& segment, std::int64_t time) {
  return GST_CLOCK_TIME_IS_VALID(gst_segment_position_from_running_time(
      &segment, GST_FORMAT_TIME, static_cast<guint64>(time)));
}

/// Adds \p shift, ns, to the times of the buffer.
void move(GstPadProbeInfo* info, std::int64_t shift) {
  GstBuffer* buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));
  info->data = buffer;
  const auto moved = [&](GstClockTime time) {
    return GST_CLOCK_TIME_IS_VALID(time) ? time + static_cast<GstClockTime>(shift) : time;
  };
  GST_BUFFER_PTS(buffer) = moved(GST_BUFFER_PTS(buffer));
  GST_BUFFER_DTS(buffer) = moved(GST_BUFFER_DTS(buffer));
}

}  // namespace

GstPadProbeReturn place_view(GstPad* pad, GstPadProbeInfo* info) {
  g_autoptr(GstElement) element = gst_pad_get_parent_element(pad);
  g_autoptr(GstEvent) event = gst_pad_get_sticky_event(pad, GST_EVENT_SEGMENT, 0);
  if (element == nullptr || event == nullptr) return GST_PAD_PROBE_OK;
  HullBuild& self = state_of<HullBuild>(element);
  Arrival arrival{GST_PAD_PROBE_INFO_BUFFER(info), {}};
  gst_event_copy_segment(event, &arrival.segment);
  const std::int64_t running = arrival.time();
  if (running == no_time || arrival.segment.rate != 1.0) return GST_PAD_PROBE_OK;
  const std::optional<View> view = times_of(arrival.buffer);
  if (!view) return GST_PAD_PROBE_OK;
  if (running < 0 || running > latest_running) {
    ++state_of<HullPadState>(pad).unusable;
    self.statistics.warn(
        element, "views-unusable",
        fmt::format("A view on {} was dropped: its buffer's time is more than 31 years after the "
                    "begin of the stream. Look at what stamps it.",
                    GST_OBJECT_NAME(pad)));
    return GST_PAD_PROBE_DROP;
  }
  // The first views come before anybody has looked whether the stream is live.
  const bool live = self.live.load() ||
                    GST_CLOCK_TIME_IS_VALID(gst_aggregator_get_latency(GST_AGGREGATOR(element)));
  const ArrivalTimes now{g_get_monotonic_time() * GST_USECOND,
                         static_cast<std::int64_t>(gst_element_get_base_time(element)),
                         running_time_now(element), g_get_real_time() * GST_USECOND, live};
  Instants::Placed placed;
  {
    const std::scoped_lock lock(self.instants_mutex);
    placed =
        self.instants.place(pad, {running, view->capture_time, view->clock, view->timecode}, now);
  }
  if (placed.jump != 0) say_jump(self, pad, placed.jump);
  if (placed.apart.from != nullptr) say_apart(self, pad, placed.apart);
  if (placed.drift != 0) say_drift(self, pad, placed.drift);
  const std::int64_t shift = placed.time - running;
  state_of<LivePadState>(pad).shift = shift;
  if (shift == 0) return GST_PAD_PROBE_OK;
  // Its segment may begin after running time 0, and reach back no further than to its start.
  const bool early = placed.time < 0 || !reaches(arrival.segment, placed.time);
  if (early) {
    GST_DEBUG_OBJECT(pad,
                     "a view of running time %" G_GINT64_FORMAT
                     " ns is dropped: it was taken before the stream began",
                     gint64{placed.time});
    ++state_of<HullPadState>(pad).early;
    self.statistics.count("views-early");
    return GST_PAD_PROBE_DROP;
  }
  GST_LOG_OBJECT(pad, "moved by %.3f ms, to when its view was taken",
                 1e-6 * static_cast<double>(shift));
  move(info, shift);
  return GST_PAD_PROBE_OK;
}

}  // namespace polyhull::element
