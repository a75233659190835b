// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The scenes that scenesrc has open: the one that it shows, the one before it, for a way back, and
/// one that is made ready beside.
///
/// Where nodes move, by the property or an animation, a source that is not live shows the scene opened and
/// lit in that pose. A live one moves what it shows, with the light that is on it, in the next frame, and
/// meanwhile lights the pose beside.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugins/common/scene/scene_file.h"
#include "plugins/scenesrc/properties.h"
#include "view/background.h"

namespace polyhull::element {

/// A scene as its file has it.
struct SceneAtRest {
  SceneFile file;
  std::shared_ptr<const Scene> rest;
  bool assumed = false;  ///< its lights and sky: the file has no light
};

/// A scene and what has been said of it.
struct OpenedScene : SceneAtRest {
  FoundPose found;     ///< that it is shown in
  bool moved = false;  ///< since its light was computed
  std::unique_ptr<Background> background;
  std::vector<Light> lights;  ///< of the scene in its pose
  float exposure = 1.0f;      ///< as in the scene's file
  Bounds bounds;
  std::string nodes_missing;  ///< what is to be said of nodes that are not there; empty: nothing
  /// ms that its light took beside the frames before; no longer there once a frame has told of it.
  std::optional<double> light_ms;

  SceneLights lights_by(const SceneSettings& settings) const {
    return scene_lights(settings, file.name, bounds, lights, assumed);
  }
  /// By what its sky is to be brighter.
  float sky_by(const SceneSettings& settings) const {
    const double own = file.environment.name.empty() ? 1.0 : settings.environment_intensity;
    return light_factor(settings, assumed) * static_cast<float>(own);
  }
};

/// Who wants a scene.
struct SceneWish {
  bool live = false;     ///< whether frames go on with the last scene meanwhile
  double seconds = 0.0;  ///< of stream time, where animations are
  /// Whether a wait is to end without a scene.
  std::function<bool()> stopped;
  /// Whether what follows is ready for the scene, which it makes ready beside from the first question on.
  std::function<bool(const SceneFile&)> followed;
  /// Says that a scene could not be had.
  std::function<void(const std::string&)> warn;
};

/// For one thread.
class Scenes {
 public:
  /// Reads the first scene, as it is at stream time 0. Throws Error.
  void open(const SceneSettings& settings);
  void close();
  bool is_open() const { return shown_ != nullptr; }
  OpenedScene& shown() const { return *shown_; }

  /// Whether another scene than shown() is being made ready.
  bool is_awaited() const { return wanted_ || latest_; }

  /// Goes over to the scene and the pose of \p settings once they can be drawn; true if shown() is another
  /// scene now, or in another pose by the properties. What cannot be opened is said, and the last one stays until
  /// something else is set.
  bool follow(const SceneSettings& settings, const SceneWish& wish);

 private:
  SceneFile file_of(const SceneSettings& settings);
  bool follow_file(const SceneSettings& settings, const SceneWish& wish);
  bool follow_pose(const SceneSettings& settings, const SceneWish& wish);
  bool make_ready(const SceneSettings& settings, const SceneWish& wish);
  FoundPose found_pose(const SceneSettings& settings, double seconds) const;
  bool move_to(const FoundPose& found, bool live);
  void open_in(const FoundPose& found, const SceneSettings& settings);
  void relight(const FoundPose& found, const SceneSettings& settings);

  SceneVersions versions_;
  std::uint64_t choice_ = 0;         // SceneSettings::scene_choice that has been looked at
  std::optional<SceneFile> wanted_;  // in the place of what is shown, and
  std::optional<SceneFile> latest_;  // after that
  std::unique_ptr<OpenedScene> shown_, before_, next_;
  std::optional<ScenePose> refused_;  // that shown_ cannot be in
  SceneFile under_way_;               // of loading_
  std::atomic<bool> stop_ = false;    // whether loading_ is to end early
  std::future<std::unique_ptr<OpenedScene>> loading_;
};

}  // namespace polyhull::element
