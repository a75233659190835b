// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The viewport that composite and scenesrc share: its properties, and mouse and keys that a video
/// sink sends back.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "plugins/common/property_table.h"
#include "scene/key_frames.h"
#include "scene/scene.h"
#include "scene/viewport_control.h"

namespace polyhull::element {

/// Places in scene metres, the field of view in degrees from the lower to the upper edge of the
/// picture. Defaults show the built-in room from its entrance.
struct ViewportSettings {
  double eye_x = 1.15, eye_y = 1.5, eye_z = 2.75;
  double target_x = 0.0, target_y = 0.98, target_z = 0.0;
  double field_of_view = 52.0;
  std::string key_frames;
  double k1 = 0.0, k2 = 0.0, k3 = 0.0, p1 = 0.0, p2 = 0.0;  // the lens's distortion

  /// As Camera::distortion; empty without any.
  std::vector<double> distortion() const;
  ViewportPose pose() const { return {{eye_x, eye_y, eye_z}, {target_x, target_y, target_z}}; }
  void set_pose(const ViewportPose& pose) {
    eye_x = pose.eye.x, eye_y = pose.eye.y, eye_z = pose.eye.z;
    target_x = pose.target.x, target_y = pose.target.y, target_z = pose.target.z;
  }
};

/// One row per property of ViewportSettings.
std::span<const Property<ViewportSettings>> viewport_properties();

/// Those of the lens's distortion among them.
std::span<const Property<ViewportSettings>> distortion_properties();

/// The key frames of an element's viewport. For one thread.
class ViewportKeyFrames {
 public:
  /// Those of the file \p path, which is read again when another one is named or it was written anew;
  /// null: it is empty. Throws Error as load_key_frames() does, each time.
  const KeyFrames* of(const std::string& path);

 private:
  std::string path_;
  std::filesystem::file_time_type written_;
  std::optional<KeyFrames> keys_;  // these two are what the file gave
  std::optional<Error> why_;
};

/// Looks at lenses that no camera can have. For one thread.
class LensWatch {
 public:
  /// What is to be said of the distortion of \p viewport, whose model turns back within the picture:
  /// once, until there is a lens again; else empty.
  std::string look(const Camera& viewport);

 private:
  Camera last_;
  bool lost_ = false;
};

/// The camera of \p view: each shot has a name of its own, for composite's motion blur. Throws Error as
/// look_at().
Camera viewport_camera(const KeyFrames::View& view, int width, int height);

/// Takes a navigation event; true: the view changes. \p height: of the picture that the mouse is
/// on, pixels. The caller holds the lock that protects \p control.
bool navigate(GstEvent* event, ViewportControl& control, int height);

}  // namespace polyhull::element
