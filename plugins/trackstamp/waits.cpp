// SPDX-License-Identifier: LGPL-2.1-or-later
// How long live frames of trackstamp wait for what comes beside them, and what that makes its latency.
#include <algorithm>
#include <utility>

#include "plugins/common/live/live_pad.h"
#include "plugins/trackstamp/private.h"

namespace polyhull::element {
namespace {

/// How long frames of an unknown rate may wait beyond their pose, ns.
constexpr std::int64_t usual_frame = 40 * GST_MSECOND;

/// What \p pad's other side says of its latency, ns; nullopt: it is not live.
std::optional<std::int64_t> latency_at(GstPad* pad) {
  g_autoptr(GstQuery) query = gst_query_new_latency();
  gboolean live = FALSE;
  GstClockTime least = 0;
  if (pad == nullptr || !gst_pad_peer_query(pad, query)) return {};
  gst_query_parse_latency(query, &live, &least, nullptr);
  if (!live) return {};
  return GST_CLOCK_TIME_IS_VALID(least) ? static_cast<std::int64_t>(least) : 0;
}

}  // namespace

/// Learns whether frames have to wait for poses, and how long.
void TrackStamp::begin_segment() {
  g_autoptr(GstPad) poses = track.linked_pad();
  const auto video = latency_at(element->sinkpad), of_poses = latency_at(poses);
  live = video.has_value();
  late = video.value_or(0);
  behind = of_poses.value_or(0) - video.value_or(0);
  GST_DEBUG_OBJECT(element, "the video is %s, and poses come %.1f ms after its frames",
                   video ? "live" : "not live", 1e-6 * static_cast<double>(behind));
}

/// The running time; none before there is a clock.
std::optional<std::int64_t> TrackStamp::now() const {
  const std::int64_t time = running_time_now(GST_ELEMENT_CAST(element));
  return time == no_time ? std::nullopt : std::optional(time);
}

/// When what comes now beside live video has come: at the begin, where that is yet to be.
std::optional<std::int64_t> TrackStamp::arrival() const {
  if (!latency_at(element->sinkpad)) return {};
  return std::max<std::int64_t>(0, now().value_or(0));
}

std::int64_t TrackStamp::wait_for_scene() const {
  return static_cast<std::int64_t>(snapshot(element, scene_settings).wait);
}

std::int64_t TrackStamp::wait_for_pose() const {
  const std::int64_t later = behind - snapshot(element, settings).delay;
  return std::max<std::int64_t>(0, later) + (frame > 0 ? frame.load() : usual_frame);
}

/// By how much frames of live video may leave later than they come, ns.
std::int64_t TrackStamp::latency() const {
  const bool by_arrival = snapshot(element, scene_settings).match == SceneMatch::arrival;
  const bool waits = depth.linked() || (scene.linked() && !by_arrival);
  return std::max(waits ? wait_for_scene() : 0, track.linked() ? wait_for_pose() : 0);
}

void TrackStamp::tell_latency() {
  const std::int64_t now = latency();
  if (told_latency.exchange(now) == now) return;
  GST_DEBUG_OBJECT(element, "has a latency of %.1f ms now", 1e-6 * static_cast<double>(now));
  gst_element_post_message(GST_ELEMENT_CAST(element),
                           gst_message_new_latency(GST_OBJECT_CAST(element)));
}

/// How long the frame of \p running_time may wait for what comes up to \p longest later: live video
/// only until it is later than its source says by that, so that waits do not add up.
std::optional<std::int64_t> TrackStamp::left(GstClockTime running_time,
                                             std::int64_t longest) const {
  if (!live) return {};
  const auto time = now();
  if (!time || !GST_CLOCK_TIME_IS_VALID(running_time)) return longest;
  const std::int64_t rest = static_cast<std::int64_t>(running_time) + late + longest - *time;
  return std::clamp<std::int64_t>(rest, 0, longest);
}

/// How long the frame at running time \p time lasts: as it says, as the caps do, or as the one before.
std::int64_t TrackStamp::length_of(GstBuffer* buffer, GstClockTime time) {
  const GstClockTime before = std::exchange(last_time, time);
  if (GST_BUFFER_DURATION_IS_VALID(buffer))
    return static_cast<std::int64_t>(GST_BUFFER_DURATION(buffer));
  if (frame > 0) return frame;
  const bool known = GST_CLOCK_TIME_IS_VALID(before) && GST_CLOCK_TIME_IS_VALID(time);
  auto length =
      known ? std::min<std::int64_t>(static_cast<std::int64_t>(time - before), GST_SECOND) : 0;
  // A gap is no frame's length; frames that have become longer are.
  if (last_length > 0) length = std::min(length, 2 * last_length);
  if (length > 0) last_length = length;
  return last_length;
}

}  // namespace polyhull::element
