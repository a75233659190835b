// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What scenesrc has while it streams: the background, its last picture and what was said of it.
#pragma once

#include <gst/base/gstbasesrc.h>
#include <gst/video/video.h>

#include <memory>
#include <string>
#include <vector>

#include "common/statistics.h"
#include "raytrace/background.h"
#include "scenesrc_properties.h"

namespace polyhull::element {

/// Running time now, or none where there is no clock or the element does not play.
GstClockTime running_time(GstBaseSrc* source);

/// Opened and closed with the state PAUSED; otherwise the streaming thread's.
class SceneStream {
 public:
  SceneStream() = default;
  ~SceneStream() { close(); }
  SceneStream(const SceneStream&) = delete;

  /// Reads the scene. Throws Error.
  void open(const SceneSettings& settings);
  void close();
  bool is_open() const { return background_ != nullptr; }
  Background& background() { return *background_; }

  /// Makes the background's picture that of stream time \p pts; what it did. An impossible viewport
  /// throws Error at first, and is a warning once there has been a possible one.
  Background::Work draw(GstElement* element, Statistics& statistics, const SceneSettings& settings,
                        const ViewportControl& control, const GstVideoInfo& info, GstClockTime pts);

  /// Traces a still view further as the settings and the time allow; true when the picture has
  /// become better.
  bool refine(GstBaseSrc* source, const SceneSettings& settings, GstClockTime pts);

  /// A buffer with the background's picture; a picture that has not changed is the same memory
  /// again.
  GstBuffer* make_buffer(const GstVideoInfo& info, bool changed);

  /// Whether the first frame of a live stream is still to be made.
  bool first_live(GstBaseSrc* source) const;

  /// Notes how late the first live frame is: the base class delays all that follow by as much.
  void start_live(GstBaseSrc* source, GstClockTime pts);

  /// Frames that a live source is too late for.
  std::uint64_t late_frames(GstBaseSrc* source, const GstVideoInfo& info, GstClockTime pts) const;

  /// The event that must go downstream before the next buffer, or null; the caller owns it.
  GstEvent* take_announcement();

 private:
  void forget_pixels();

  std::unique_ptr<Background> background_;
  std::vector<Light> lights_;    // as in the scene's file
  float exposure_ = 1.0f;        // as in the scene's file
  GstMemory* pixels_ = nullptr;  // of the last frame, shared with the buffers that show it
  GstVideoFormat pixels_format_ = GST_VIDEO_FORMAT_UNKNOWN;
  Camera camera_;          // the last good one; width 0: none yet
  std::string announced_;  // what downstream was last told
  GstClockTime delay_ = GST_CLOCK_TIME_NONE;
};

}  // namespace polyhull::element
