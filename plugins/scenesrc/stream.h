// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What scenesrc has while it streams: the background, its last picture and what was said of it.
#pragma once

#include <gst/base/gstbasesrc.h>
#include <gst/video/video.h>

#include <optional>
#include <string>
#include <utility>

#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/statistics.h"
#include "plugins/scenesrc/properties.h"
#include "plugins/scenesrc/scenes.h"
#include "view/background.h"

namespace polyhull::element {

/// Opened and closed with the state PAUSED; otherwise the streaming thread's.
class SceneStream {
 public:
  SceneStream() = default;
  SceneStream(const SceneStream&) = delete;

  /// Reads the scene. Throws Error.
  void open(const SceneSettings& settings);
  void close();
  bool is_open() const { return scenes_.is_open(); }
  Background& background() { return *scenes_.shown().background; }

  /// As Scenes::follow().
  bool follow_scene(const SceneSettings& settings, const SceneWish& wish);

  /// ms that the light took that draw() told of where that was not the frame's time; once.
  std::optional<double> take_light_ms() {
    return std::exchange(scenes_.shown().light_ms, std::nullopt);
  }

  /// Makes the background's picture that of stream time \p pts, from \p tracked where it tells a camera;
  /// what it did. An impossible viewport
  /// throws Error at first, and is a warning once there has been a possible one.
  Background::Work draw(GstElement* element, Statistics& statistics, const SceneSettings& settings,
                        const ViewportControl& control, const std::optional<TrackedPose>& tracked,
                        const GstVideoInfo& info, GstClockTime pts);

  /// Traces a still view further as the settings allow, in a live stream until running time is
  /// \p due; true when the picture has become better.
  bool refine(GstBaseSrc* source, const SceneSettings& settings, const GstVideoInfo& info,
              GstClockTime due);

  /// What is to be said of a scene without light, or of which parts are not drawn; empty: nothing.
  std::string about_scene(const SceneSettings& settings) const;

  /// What is to be said, once for each scene in whatever pose, of a picture most of which is white for being
  /// exposed too long; empty: it is not.
  std::string clipped(const SceneSettings& settings);

  /// A buffer with the background's picture; a picture that has not changed is the same memory
  /// again.
  GstBuffer* make_buffer(const GstVideoInfo& info, bool changed);

  /// Whether there has been a picture: the light is computed.
  bool is_lit() const { return camera_.width > 0; }

  /// The event that must go downstream before the next buffer, or null; the caller owns it.
  GstEvent* take_announcement();

 private:
  Scenes scenes_;
  bool other_scene_ = false;  // than in the last picture
  ViewportKeyFrames key_frames_;
  // The last picture. Its memory is in two buffers wherever one of them is sent: nobody may write to it.
  Ref<GstBuffer> sent_;
  GstVideoFormat sent_format_ = GST_VIDEO_FORMAT_UNKNOWN;
  LensWatch lens_watch_;
  std::vector<Light> undimmed_;  // Announcement::undimmed
  std::optional<Vec3f> undimmed_sky_;
  std::string lights_missing_;                    // what was said of them last
  std::optional<SceneFile> clipped_;              // of which clipped() has told last
  Camera camera_;                                 // the last good one; width 0: none yet
  double aperture_ = 0.0, focus_distance_ = 0.0;  // of its lens, where that is tracked
  std::string announced_;                         // what downstream was last told
};

}  // namespace polyhull::element
