// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/trackstamp/scene_match.h"

#include <gst/video/video.h>

#include <algorithm>
#include <memory>

#include "base/error.h"
#include "plugins/common/capture_clock.h"

namespace polyhull::element {
namespace {

struct TimeCodeFree {
  void operator()(GstVideoTimeCode* timecode) const { gst_video_time_code_free(timecode); }
};
using TimeCode = std::unique_ptr<GstVideoTimeCode, TimeCodeFree>;

TimeCode make_timecode(int numerator, int denominator, GstVideoTimeCodeFlags flags, guint hours,
                       guint minutes, guint seconds, guint frames) {
  TimeCode made(gst_video_time_code_new_empty());
  gst_video_time_code_init(made.get(), static_cast<guint>(numerator),
                           static_cast<guint>(denominator), nullptr, flags, hours, minutes, seconds,
                           frames, 0);
  return made;
}

/// A day of timecodes, ns.
std::int64_t day_of(int numerator, int denominator, GstVideoTimeCodeFlags flags) {
  const int nominal = (numerator + denominator - 1) / denominator;
  const TimeCode last = make_timecode(numerator, denominator, flags, 23, 59, 59,
                                      static_cast<guint>(std::max(0, nominal - 1)));
  return static_cast<std::int64_t>(gst_video_time_code_nsec_since_daily_jam(last.get()) +
                                   gst_util_uint64_scale_int(GST_SECOND, denominator, numerator));
}

/// \p message's timecode at its rate, as ns since midnight; sets \p period to a day of such.
std::int64_t timecode_of_message(const TimedAnnouncement& message, std::int64_t& period) {
  if (message.timecode.empty())
    throw Error(Error::Kind::bad_input,
                "It has no 'timecode', by which scene-match=timecode finds its frame.");
  const TimeCode text(gst_video_time_code_new_from_string(message.timecode.c_str()));
  const int numerator = message.timecode_numerator, denominator = message.timecode_denominator;
  const TimeCode timecode =
      text ? make_timecode(numerator, denominator, text->config.flags, text->hours, text->minutes,
                           text->seconds, text->frames)
           : nullptr;
  if (!timecode || !gst_video_time_code_is_valid(timecode.get()))
    throw Error(Error::Kind::bad_input, "There is no timecode '{}' at {}/{} frames per second.",
                message.timecode, numerator, denominator);
  period = day_of(numerator, denominator, text->config.flags);
  return static_cast<std::int64_t>(gst_video_time_code_nsec_since_daily_jam(timecode.get()));
}

}  // namespace

template <>
GType enum_type<SceneMatch>() {
  return register_enum<SceneMatch>(
      "PolyhullSceneMatch",
      {{SceneMatch::timecode, "Timecode of the frames and of the messages", "timecode"},
       {SceneMatch::clock, "When the frame was taken, since 1970; unix_time_ns of the messages",
        "clock"},
       {SceneMatch::stream_time, "Time from the begin of the video; stream_time_ns of the messages",
        "stream-time"},
       {SceneMatch::arrival, "When a message came", "arrival"}});
}

std::span<const Property<SceneInputSettings>> scene_input_properties() {
  static const Property<SceneInputSettings> table[] = {
      property<&SceneInputSettings::match>("scene-match",
                                           "By what a message at the pad scene finds its frame."),
      property<&SceneInputSettings::delay>(
          "scene-delay",
          "By how many nanoseconds a message at the pad scene holds later than it says (-10 s to "
          "10 s): what the video is late against its timecode or time, or, with "
          "scene-match=arrival, against the messages.",
          -1e10, 1e10),
      property<&SceneInputSettings::wait>(
          "scene-wait",
          "How many nanoseconds a frame of live video waits for its message at the pad scene and "
          "its depth at the pad depth (0 to 10 s) beyond when it comes; part of the latency. With "
          "scene-match=arrival it waits for no message.",
          0, 1e10),
      property<&SceneInputSettings::file>(
          "scene-file",
          "Path of the glTF file in the place of the one that messages at the pad scene name, as "
          "the program's machine may have it elsewhere. Unset: theirs.")};
  return table;
}

std::int64_t time_of_message(const TimedAnnouncement& message, SceneMatch match,
                             std::optional<std::int64_t> arrival, std::int64_t& period) {
  const auto or_refuse = [](std::optional<std::int64_t> time, const char* what) {
    if (!time) throw Error(Error::Kind::bad_input, "{}", what);
    return *time;
  };
  switch (match) {
    case SceneMatch::timecode:
      return timecode_of_message(message, period);
    case SceneMatch::clock:
      return or_refuse(message.unix_time_ns,
                       "It has no 'unix_time_ns', by which scene-match=clock finds its frame.");
    case SceneMatch::stream_time:
      return or_refuse(
          message.stream_time_ns,
          "It has no 'stream_time_ns', by which scene-match=stream-time finds its frame.");
    default:
      return or_refuse(arrival,
                       "It came without a time, by which scene-match=arrival finds its frame, "
                       "beside video that is not live or has not begun. Of files match by what it "
                       "tells: scene-match=timecode, clock or stream-time.");
  }
}

const char* missing_in_frames(SceneMatch match) {
  switch (match) {
    case SceneMatch::timecode:
      return "has no timecode: put timecodestamper, or what reads the video's own, before "
             "trackstamp";
    case SceneMatch::clock:
      return "does not tell when it was taken since 1970 (a reference timestamp of "
             "timestamp/x-unix or x-ntp)";
    default:
      return "has no time";
  }
}

/// The time by which \p frame is to be found; none where it does not tell.
std::optional<std::int64_t> time_of_frame(GstBuffer* frame, const GstSegment& segment,
                                          SceneMatch match) {
  std::int64_t time = no_time;
  CaptureClock clock = CaptureClock::unix;
  GstClockTime stamp = GST_CLOCK_TIME_NONE;
  const bool timed = segment.format == GST_FORMAT_TIME;
  switch (match) {
    case SceneMatch::timecode:
      time = timecode_of(frame);
      break;
    case SceneMatch::clock:
      find_camera_time(frame, time, clock, CaptureClock::unix);
      break;
    case SceneMatch::stream_time:
      if (timed)
        stamp = gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, GST_BUFFER_PTS(frame));
      break;
    case SceneMatch::arrival:
      if (timed)
        stamp = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, GST_BUFFER_PTS(frame));
      break;
  }
  if (GST_CLOCK_TIME_IS_VALID(stamp)) time = static_cast<std::int64_t>(stamp);
  return time == no_time ? std::nullopt : std::optional(time);
}

bool drops_timecodes(GstBuffer* frame) {
  const GstVideoTimeCodeMeta* meta = gst_buffer_get_video_time_code_meta(frame);
  return meta != nullptr && (meta->tc.config.flags & GST_VIDEO_TIME_CODE_FLAGS_DROP_FRAME) != 0;
}

std::int64_t period_of_frame(GstBuffer* frame, SceneMatch match) {
  if (match != SceneMatch::timecode || timecode_of(frame) == no_time) return 0;
  const GstVideoTimeCodeConfig& config = gst_buffer_get_video_time_code_meta(frame)->tc.config;
  return day_of(static_cast<int>(config.fps_n), static_cast<int>(config.fps_d), config.flags);
}

}  // namespace polyhull::element
