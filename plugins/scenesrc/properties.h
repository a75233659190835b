// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// The properties of scenesrc, and the viewport and lights that follow from them.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plugins/common/viewport.h"
#include "scene/animation/scene_pose.h"
#include "scene/scene.h"
#include "track/tracked_pose.h"
#include "view/background.h"

namespace polyhull::element {

enum class ViewportPath { still, orbit };
enum class Refinement { automatic, always, never };

/// Metres, degrees, and degrees per second of stream time.
struct SceneSettings : ViewportSettings {
  std::string scene;
  std::string environment;
  double environment_turn = 0.0;
  std::uint64_t scene_choice = 0;  // how often one of these has been set
  double environment_intensity = 1.0;
  std::string nodes;      // as parse_node_changes() takes it
  std::string animation;  // as find_animation() takes it
  bool animation_loop = true;
  std::string camera;
  ViewportPath path = ViewportPath::still;
  double orbit_radius = 2.7, orbit_height = 1.5, orbit_speed = 12.0, orbit_start = 0.0;
  std::string lights;  // as parse_light_changes() takes it
  double light_intensity = 1.0;
  double light_x = 0.0, light_y = 0.0, light_z = 0.0;
  bool assumed_light = true;
  double exposure_compensation = 0.0;  // stops
  Refinement refinement = Refinement::automatic;
  std::uint32_t samples = 256;
  ViewMethod method = ViewMethod::raster;
  double smoothing = 0.045;
  double light_spacing = 0.025;
  bool light_cache = true;
  bool progressive = true;
  bool live = false;
};

/// One row per property of SceneSettings that is not the viewport's.
std::span<const Property<SceneSettings>> scene_properties();

/// The viewport at stream time \p seconds, for a picture of \p width x \p height square pixels: that of
/// the tracked camera where \p tracked tells it, else that of \p keys (null: none). Throws Error when the settings or it make none (eye =
/// target, no such camera in the scene).
Camera scene_viewport(const SceneSettings& settings, const ViewportControl& control,
                      const std::optional<TrackedPose>& tracked, const KeyFrames* keys,
                      const Scene& scene, double seconds, int width, int height);

/// A pose of a scene.
struct FoundPose {
  ScenePose pose;
  std::string missing;  ///< what is to be said of an animation that is not there; empty: nothing
  bool operator==(const FoundPose&) const = default;
};

/// Where the settings and the animation have the nodes of \p scene, as its file gave it, at stream time \p seconds.
FoundPose scene_pose(const SceneSettings& settings, const Scene& scene, double seconds);
/// The time in animation \p number of \p scene then.
double time_of(int number, const Scene& scene, const SceneSettings& settings, double seconds);

/// Two sentences, either of which may be empty.
std::string joined(const std::string& first, const std::string& second);

/// A scene's lights.
struct SceneLights {
  std::vector<Light> lights;
  std::vector<Light> undimmed;  ///< the same, as bright and of the colour that the file says
  std::string
      missing;  ///< what is to be said of those that the property lights names in vain; empty: nothing
};

/// \p lights, as the file of \p scene has them or as they are \p assumed, changed as the settings say. \p
/// bounds are the scene's.
SceneLights scene_lights(const SceneSettings& settings, const std::string& scene,
                         const Bounds& bounds, std::vector<Light> lights, bool assumed);
/// The factor on all lights' brightness, 0 for \p assumed ones that are not wanted.
float light_factor(const SceneSettings& settings, bool assumed);

}  // namespace polyhull::element
