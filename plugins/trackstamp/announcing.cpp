// SPDX-License-Identifier: LGPL-2.1-or-later
// What trackstamp announces: scene and lights as they were announced to it, through the tracked camera.
#include "base/error.h"
#include "plugins/trackstamp/private.h"
#include "scene/drawable.h"

namespace polyhull::element {

void TrackStamp::take_announcement(GstEvent* event) {
  try {
    const gchar* json = gst_structure_get_string(gst_event_get_structure(event), "json");
    if (json == nullptr) throw Error(Error::Kind::bad_input, "The event has no field 'json'.");
    from_upstream = parse_announcement(json);
  } catch (const std::exception& error) {
    statistics.warn(GST_ELEMENT_CAST(element), "announcements-unusable",
                    fmt::format("What upstream announced is not used: {}", error.what()));
  }
}

/// Takes the camera of \p pose; one that nothing can be drawn with leaves the one before.
void TrackStamp::look_through(const TrackedPose& pose) {
  try {
    const TrackStampSettings now = snapshot(element, settings);
    Camera camera = camera_of(pose, width, height, now.field_of_view, pixel_aspect);
    if (camera.distortion.empty()) camera.distortion = now.distortion();
    check_viewport(camera);
    check_projection(camera);
    tracked.viewport = camera;
    tracked.aperture = aperture_of(pose);
    tracked.focus_distance = pose.focus_distance_m.value_or(0.0);
  } catch (const Error& error) {
    statistics.warn(
        GST_ELEMENT_CAST(element), "poses-unusable",
        fmt::format("A pose of the track is not used, the one before stays: {}", error.what()));
  }
}

/// Says what is true from the next frame on, unless it was said already. Where a frame has no pose of
/// its own, the tracked camera stays where it was.
void TrackStamp::announce(std::optional<Announcement> scene, std::optional<TrackedPose> pose) {
  Announcement announcement = scene ? std::move(*scene) : from_upstream;
  if (pose) look_through(*pose);
  if (track.linked() && tracked.viewport.width > 0) {
    announcement.viewport = tracked.viewport;
    announcement.aperture = tracked.aperture;
    announcement.focus_distance = tracked.focus_distance;
  }
  if (announcement.viewport.width == 0) return;  // nobody has told a camera
  std::string json = announcement_to_json(announcement);
  if (say_again.exchange(false)) announced.clear();
  if (json == announced) return;
  announced = std::move(json);
  statistics.count("announcements");
  GST_DEBUG_OBJECT(element, "announces %s", announced.c_str());
  gst_pad_push_event(
      element->srcpad,
      gst_event_new_custom(GST_EVENT_CUSTOM_DOWNSTREAM_STICKY,
                           gst_structure_new("polyhull-announcement", "json", G_TYPE_STRING,
                                             announced.c_str(), nullptr)));
}

/// When \p buffer's camera is to be looked up in the track; none where it does not tell.
std::optional<TrackMoment> TrackStamp::moment_of(GstBuffer* buffer) const {
  const TrackStampSettings now = snapshot(element, settings);
  const bool by_timecode = now.match == TrackMatch::timecode;
  const SceneMatch match = by_timecode ? SceneMatch::timecode : SceneMatch::arrival;
  const auto time = time_of_frame(buffer, element->segment, match);
  if (!time) return {};
  return TrackMoment{*time - now.delay, now.match, period_of_frame(buffer, match),
                     by_timecode && drops_timecodes(buffer)};
}

}  // namespace polyhull::element
