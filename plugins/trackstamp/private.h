// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What the parts of trackstamp share: its state.
#pragma once

#include <gst/base/gstbasetransform.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "plugins/common/camera/camera_track.h"
#include "plugins/common/element.h"
#include "plugins/common/log.h"
#include "plugins/trackstamp/depth_input.h"
#include "plugins/trackstamp/properties.h"
#include "plugins/trackstamp/scene_input.h"
#include "scene/announcement.h"

GST_DEBUG_CATEGORY_EXTERN(trackstamp_debug);
#define GST_CAT_DEFAULT trackstamp_debug

namespace polyhull::element {

struct TrackStamp {
  static constexpr char type_name[] = "PolyhullTrackStamp";
  static GType base_type() { return GST_TYPE_BASE_TRANSFORM; }
  static void class_init(gpointer klass);
  explicit TrackStamp(gpointer object);

  void begin_segment();
  std::optional<std::int64_t> now() const;
  std::optional<std::int64_t> arrival() const;
  void unlock(bool unlocked) {
    track.unlock(unlocked);
    scene.unlock(unlocked);
    depth.unlock(unlocked);
  }
  void look_through(const TrackedPose& pose);
  void announce(std::optional<Announcement> scene, std::optional<TrackedPose> pose);
  std::int64_t wait_for_scene() const;
  std::int64_t wait_for_pose() const;
  std::int64_t latency() const;
  void tell_latency();
  void property_set(gpointer, std::string_view name);
  std::optional<std::int64_t> left(GstClockTime running_time, std::int64_t longest) const;
  std::int64_t length_of(GstBuffer* buffer, GstClockTime time);
  std::optional<TrackMoment> moment_of(GstBuffer* buffer) const;
  void take_announcement(GstEvent* event);

  TrackStampSettings settings;        // under the object lock
  SceneInputSettings scene_settings;  // likewise
  GstBaseTransform* element;
  Statistics statistics{"trackstamp-stats"};
  CameraTrack track;
  SceneInput scene;
  DepthInput depth;
  std::atomic<bool> live{false};        // the video
  std::atomic<std::int64_t> late{0};    // how late it comes by what its source says, ns
  std::atomic<std::int64_t> frame{0};   // how long one lasts, ns; 0: the caps do not tell
  std::atomic<std::int64_t> behind{0};  // how much later than frames poses come, ns, or before
  std::atomic<std::int64_t> told_latency{0};  // ns
  std::atomic<bool> say_again{false};
  // The streaming thread's.
  int width = 0, height = 0;
  double pixel_aspect = 1;
  GstClockTime last_time = GST_CLOCK_TIME_NONE;  // of the frame before
  std::int64_t last_length = 0;                  // to it, ns
  Announcement from_upstream;                    // the scene is empty where nothing was announced
  Announcement tracked;  // camera and lens of the last pose, for this size of picture
  std::string announced;
};

}  // namespace polyhull::element
