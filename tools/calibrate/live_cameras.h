// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Grey pictures of one instant from live cameras, and a window to show pictures in.
#pragma once

#include <gst/gst.h>

#include <optional>
#include <string>
#include <vector>

#include "base/picture.h"

namespace polyhull::calibrate_tool {

/// A camera's name and the GStreamer elements that bring its pictures.
struct LiveSource {
  std::string name, elements;
};

/// "NAME=ELEMENTS", as in cam0=v4l2src device=/dev/video0. Throws Error.
LiveSource parse_source(const std::string& text);

class LiveCameras {
 public:
  /// Starts all cameras in one pipeline, so with one clock. Throws Error, naming the camera, where the
  /// elements are not understood or do not start.
  explicit LiveCameras(const std::vector<LiveSource>& sources);
  ~LiveCameras();
  LiveCameras(const LiveCameras&) = delete;

  /// The newest picture of each camera; none of one that has sent nothing new for a second, or
  /// nothing within \p tolerance ns of the earliest of the others'. Throws Error, naming the camera,
  /// where one fails. False: all have ended.
  bool take(GstClockTime tolerance, std::vector<std::optional<Picture>>& pictures);

 private:
  struct Camera {
    std::string name;
    GstElement* sink;
  };
  void throw_errors();

  GstElement* pipeline_ = nullptr;
  GstBus* bus_ = nullptr;
  std::vector<Camera> cameras_;
};

/// Shows RGB pictures of one size.
class Window {
 public:
  /// \p elements: what shows or writes them, such as autovideosink. Throws Error.
  explicit Window(const std::string& elements);
  ~Window();
  Window(const Window&) = delete;

  void show(const Picture& picture);

 private:
  GstElement* pipeline_ = nullptr;
  GstElement* source_ = nullptr;
};

}  // namespace polyhull::calibrate_tool
