// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// trackstamp: announces with each frame of video that comes from elsewhere (a real camera, another
/// program, a file) where the tracked camera was at its time, or what the program says of its camera,
/// lights and scene, so that composite draws its subjects with exactly that.
#include <gst/base/gstbasetransform.h>
#include <gst/video/video.h>

#include <optional>
#include <string>

#include "base/error.h"
#include "plugins/common/guard.h"
#include "plugins/common/live/live_pad.h"
#include "plugins/common/memory/scene_metas.h"
#include "plugins/common/transform.h"
#include "plugins/trackstamp/private.h"

GST_DEBUG_CATEGORY(trackstamp_debug);

namespace polyhull::element {

TrackStamp::TrackStamp(gpointer object)
    : element(GST_BASE_TRANSFORM(object)),
      track(GST_ELEMENT_CAST(object), statistics,
            [this] { return snapshot(element, settings).match; }),
      scene(
          GST_ELEMENT_CAST(object), statistics,
          [this] { return snapshot(element, scene_settings); }, [this] { return arrival(); }),
      depth(GST_ELEMENT_CAST(object), statistics,
            [this] { return snapshot(element, scene_settings); }) {
  statistics.declare({"frames", "announcements", "frames-untimed", "announcements-unusable"});
  gst_base_transform_set_passthrough(element, TRUE);
  gst_base_transform_set_qos_enabled(element, FALSE);
  const auto pad_template = [object](const char* name) {
    return gst_element_class_get_pad_template(GST_ELEMENT_GET_CLASS(object), name);
  };
  gst_element_add_pad(GST_ELEMENT_CAST(object), track.make_pad(pad_template("track")));
  gst_element_add_pad(GST_ELEMENT_CAST(object), scene.make_pad(pad_template("scene")));
  gst_element_add_pad(GST_ELEMENT_CAST(object), depth.make_pad(pad_template("depth")));
}

void TrackStamp::property_set(gpointer, std::string_view name) {
  if (name.starts_with("scene-") || name.starts_with("track-")) tell_latency();
}

namespace {

GstFlowReturn stamp(GstBaseTransform* base, GstBuffer* buffer) {
  TrackStamp& self = state_of<TrackStamp>(base);
  return guarded(GST_ELEMENT(base), GST_FLOW_ERROR, [&] {
    self.statistics.count("frames");
    const guint64 time =
        gst_segment_to_running_time(&base->segment, GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
    const std::int64_t duration = self.length_of(buffer, time);
    std::optional<Announcement> scene =
        self.scene.at(buffer, base->segment, duration, self.left(time, self.wait_for_scene()));
    if (auto depth =
            self.depth.at(buffer, base->segment, duration, self.left(time, self.wait_for_scene()),
                          scene ? scene->depth_near : 0.0);
        depth && gst_buffer_is_writable(buffer))  // who shares the buffer reads its metas
      DepthMeta::set(buffer, std::move(depth));
    if (self.track.unlocked()) return GST_FLOW_FLUSHING;
    const std::optional<TrackMoment> moment = self.moment_of(buffer);
    std::optional<TrackedPose> pose;
    if (moment) {
      pose = self.track.at(*moment, self.left(time, self.wait_for_pose()));
    } else if (self.track.linked()) {
      const bool by_timecode = snapshot(self.element, self.settings).match == TrackMatch::timecode;
      self.statistics.warn(
          GST_ELEMENT(base), "frames-untimed",
          fmt::format("A frame {}, so it is not known where the tracked camera was: the one of the "
                      "frame before stays.{}",
                      missing_in_frames(by_timecode ? SceneMatch::timecode : SceneMatch::arrival),
                      by_timecode ? "" : " Let its source give times."));
    }
    if (self.track.unlocked()) return GST_FLOW_FLUSHING;
    GST_LOG_OBJECT(base, "%s, %s: %" GST_PTR_FORMAT, pose ? "with a pose" : "without a pose",
                   scene ? "with what was announced" : "without an announcement", printed(buffer));
    self.announce(std::move(scene), pose);
    return GST_FLOW_OK;
  });
}

/// A frame whose depth is to be attached must be writable; its pixels stay where they are.
GstFlowReturn prepare_output_buffer(GstBaseTransform* base, GstBuffer* in, GstBuffer** out) {
  const bool copied = state_of<TrackStamp>(base).depth.linked() && !gst_buffer_is_writable(in);
  *out = copied ? gst_buffer_copy(in) : in;
  return GST_FLOW_OK;
}

gboolean set_caps(GstBaseTransform* base, GstCaps* caps, GstCaps*) {
  TrackStamp& self = state_of<TrackStamp>(base);
  const GstStructure* format = gst_caps_get_structure(caps, 0);
  gint numerator = 0, denominator = 1;
  if (!gst_structure_get_int(format, "width", &self.width) ||
      !gst_structure_get_int(format, "height", &self.height) || self.width < 1 || self.height < 1) {
    GST_ELEMENT_ERROR(base, STREAM, FORMAT,
                      ("Frames of %" GST_PTR_FORMAT
                       " have no width and height. Put trackstamp where video passes.",
                       static_cast<void*>(caps)),
                      (nullptr));
    return FALSE;
  }
  gst_structure_get_fraction(format, "framerate", &numerator, &denominator);
  gint across = 1, down = 1;
  gst_structure_get_fraction(format, "pixel-aspect-ratio", &across, &down);
  self.pixel_aspect = across > 0 && down > 0 ? 1.0 * across / down : 1.0;
  self.tracked = {};
  self.last_time = GST_CLOCK_TIME_NONE;
  self.last_length = 0;
  const std::int64_t frame =
      numerator > 0
          ? static_cast<std::int64_t>(gst_util_uint64_scale_int(GST_SECOND, denominator, numerator))
          : 0;
  if (self.frame.exchange(frame) != frame) self.tell_latency();
  self.say_again = true;
  GST_DEBUG_OBJECT(base, "takes %" GST_PTR_FORMAT, printed(caps));
  return TRUE;
}

gboolean sink_event(GstBaseTransform* base, GstEvent* event) {
  TrackStamp& self = state_of<TrackStamp>(base);
  if (gst_event_has_name(event, "polyhull-announcement")) {
    self.take_announcement(event);
    gst_event_unref(event);
    return TRUE;
  }
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_START) self.unlock(true);
  if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) {
    self.unlock(false);
    self.track.video_flushed(gst_event_get_seqnum(event));
    self.scene.video_flushed();
    self.depth.video_flushed();
    self.say_again = true;
  }
  if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) {
    self.track.video_flushed();  // nor is a frame to come of before where a seek has not flushed
    self.last_time = GST_CLOCK_TIME_NONE;
    self.begin_segment();
  }
  return GST_BASE_TRANSFORM_CLASS(parent_class<TrackStamp>())->sink_event(base, event);
}

/// A seek is the track's and the messages', too.
gboolean src_event(GstBaseTransform* base, GstEvent* event) {
  TrackStamp& self = state_of<TrackStamp>(base);
  const bool seeks = GST_EVENT_TYPE(event) == GST_EVENT_SEEK;
  if (seeks) {
    self.track.seek(gst_event_ref(event));
    self.scene.rewind();
    self.depth.push_upstream(gst_event_ref(event));
  }
  const gboolean taken =
      GST_BASE_TRANSFORM_CLASS(parent_class<TrackStamp>())->src_event(base, event);
  if (seeks && !taken) self.track.seek_failed();
  return taken;
}

/// A frame of a live stream may wait until its poses are there, and a frame more, or by scene-wait.
gboolean query(GstBaseTransform* base, GstPadDirection direction, GstQuery* query) {
  TrackStamp& self = state_of<TrackStamp>(base);
  if (!GST_BASE_TRANSFORM_CLASS(parent_class<TrackStamp>())->query(base, direction, query))
    return FALSE;
  if (direction != GST_PAD_SRC || GST_QUERY_TYPE(query) != GST_QUERY_LATENCY) return TRUE;
  gboolean live = FALSE;
  GstClockTime least = 0, most = 0;
  gst_query_parse_latency(query, &live, &least, &most);
  if (!live) return TRUE;
  self.begin_segment();
  const std::int64_t waits = self.latency();
  self.told_latency = waits;
  gst_query_set_latency(query, live, least + static_cast<GstClockTime>(waits), most);
  return TRUE;
}

gboolean start(GstBaseTransform* base) {
  TrackStamp& self = state_of<TrackStamp>(base);
  self.statistics.reset();
  self.from_upstream = self.tracked = {};
  self.track.video_flushed();
  self.scene.reset();
  self.announced.clear();
  return TRUE;
}

GstStateChangeReturn change_state(GstElement* element, GstStateChange transition) {
  TrackStamp& self = state_of<TrackStamp>(element);
  if (transition == GST_STATE_CHANGE_READY_TO_PAUSED) self.unlock(false);
  if (transition == GST_STATE_CHANGE_PAUSED_TO_READY) self.unlock(true);
  return GST_ELEMENT_CLASS(parent_class<TrackStamp>())->change_state(element, transition);
}

}  // namespace

void TrackStamp::class_init(gpointer klass) {
  GST_DEBUG_CATEGORY_INIT(trackstamp_debug, "trackstamp", 0, "frames and their tracked camera");
  add_properties<TrackStamp>(klass, field_of_view_properties(), &TrackStamp::settings);
  add_properties<TrackStamp>(klass, track_match_properties(), &TrackStamp::settings);
  add_properties<TrackStamp>(klass, distortion_properties(), &TrackStamp::settings);
  add_properties<TrackStamp>(klass, scene_input_properties(), &TrackStamp::scene_settings);
  add_statistics<TrackStamp>(
      klass,
      "Counters since the start: frames, frames-untimed (that do not tell what track-match asks "
      "for), announcements (frames with another camera "
      "than the one before), announcements-unusable (of upstream); of the pad track poses, "
      "poses-unusable, poses-untimed (that do not tell it), frames-tracked, frames-untracked "
      "(before the first pose, or more than a second after the last), frames-ahead (tracked, but "
      "later than the last pose), "
      "track-losses; of the pad scene scene-messages, scene-messages-unusable, "
      "scene-messages-untimed (that do not tell what scene-match asks for), scene-messages-late "
      "(the frame had gone), frames-announced, frames-unannounced (before the first message, or "
      "more than a second after the last), frames-unmatchable (that do not tell what scene-match "
      "asks for), scene-losses; of the pad depth depth-frames, depth-frames-unmatchable, "
      "depth-frames-unusable, "
      "frames-without-depth (that none came for, or that no depth_near was announced for), "
      "depth-losses.");
  set_metadata(klass, "Track stamp", "Filter/Video",
               "Announces with each frame where the tracked camera was, or an outside renderer's "
               "camera, lights and scene");
  add_template(klass, "sink", GST_PAD_SINK, "ANY");
  add_template(klass, "src", GST_PAD_SRC, "ANY");
  add_template(klass, "track", GST_PAD_SINK, camera_caps);
  add_template(klass, "scene", GST_PAD_SINK, "ANY");
  add_template(klass, "depth", GST_PAD_SINK, depth_caps);
  GST_ELEMENT_CLASS(klass)->change_state = change_state;
  auto* base_class = GST_BASE_TRANSFORM_CLASS(klass);
  base_class->start = start;
  base_class->set_caps = set_caps;
  base_class->sink_event = sink_event;
  base_class->src_event = src_event;
  base_class->query = query;
  base_class->before_transform = sync_controlled_properties;
  base_class->prepare_output_buffer = prepare_output_buffer;
  base_class->transform_ip = stamp;
}

}  // namespace polyhull::element

using namespace polyhull::element;
GST_ELEMENT_REGISTER_DEFINE(trackstamp, "trackstamp", GST_RANK_NONE, type_of<TrackStamp>())
