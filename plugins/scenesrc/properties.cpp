// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/scenesrc/properties.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "plugins/common/scene/parsed_property.h"
#include "scene/animation/animation.h"
#include "scene/changes/named_parts.h"
#include "scene/changes/scene_changes.h"

namespace polyhull::element {

template <>
GType enum_type<ViewportPath>() {
  return register_enum<ViewportPath>(
      "PolyhullViewportPath",
      {{ViewportPath::still, "Stay where eye, target or camera say", "still"},
       {ViewportPath::orbit, "Travel around the target on a circle", "orbit"}});
}

template <>
GType enum_type<Refinement>() {
  return register_enum<Refinement>(
      "PolyhullRefinement",
      {{Refinement::automatic,
        "Live: in the time that is left until the next frame; not live: none", "auto"},
       {Refinement::always, "One sample per pixel more with each frame, however long it takes",
        "always"},
       {Refinement::never, "None", "never"}});
}

template <>
GType enum_type<ViewMethod>() {
  return register_enum<ViewMethod>(
      "PolyhullViewMethod",
      {{ViewMethod::raster, "Rasterised; by rays only what curved mirrors and their like show",
        "raster"},
       {ViewMethod::rays, "By rays alone: several times slower, and smooths shadows' edges, too",
        "rays"}});
}

namespace {

using S = SceneSettings;

constexpr double far = 1e6;
constexpr Property<S> table[] = {
    property<&S::scene>("scene",
                        "Path of a glTF 2.0 file (.glb or .gltf) in metres, y up, or one that "
                        "ships, builtin:room (empty, too) or builtin:apartment. While playing the "
                        "next one is loaded beside the last one, which a live source shows until "
                        "then; a file that was written anew is loaded again when it is set again."),
    property<&S::camera>("camera",
                         "Name of a camera of the scene to look through. Empty: the viewport is "
                         "that of eye, target and field-of-view."),
    property<&S::path>(
        "path", "How the viewport moves with stream time. On its orbit it looks at the target."),
    property<&S::orbit_radius>("orbit-radius",
                               "Radius of the orbit around the target, metres, 0.01 to 1000000.",
                               0.01, far),
    property<&S::orbit_height>("orbit-height",
                               "Height (y) of the orbit, metres, -1000000 to 1000000.", -far, far),
    property<&S::orbit_speed>("orbit-speed",
                              "Speed on the orbit, degrees per second of stream time, -3600 to "
                              "3600; counter-clockwise seen from above where positive.",
                              -3600.0, 3600.0),
    property<&S::orbit_start>("orbit-start",
                              "Angle on the orbit at stream time 0, degrees from the z axis "
                              "towards the x axis, -360 to 360.",
                              -360.0, 360.0),
    parsed_property<&S::nodes, parse_node_changes>(
        "nodes",
        "How nodes of the scene differ from what its file says, with all that hangs on them: "
        "entries with semicolons between, each the name of a node (with spaces in quotes) and what "
        "of move=X,Y,Z (metres), turn=X,Y,Z (degrees about x, then y, then z, through the node's "
        "origin), scale=FACTOR and visible=yes or no changes. They are there with the next frame, "
        "and the light on them follows; live, what is hidden or comes back comes with its light.",
        "node changes as in door turn=0,80,0; vase move=0.5,0,0 scale=2; chair visible=no, with "
        "finite numbers"),
    property<&S::animation>(
        "animation",
        "Which of the scene's animations plays, from stream time 0 on: its name, else its number "
        "from 1 on; 0: none. Empty: the first one, if the scene has any."),
    property<&S::animation_loop>(
        "animation-loop", "Whether the animation begins again where it ends; else its end stays."),
    parsed_property<&S::lights, parse_light_changes>(
        "lights",
        "How lights differ from what the scene's file says: entries with semicolons between, each "
        "the name of a light (with spaces in quotes), its number from 1 on or * for all, and what "
        "of intensity=FACTOR, colour=RED,GREEN,BLUE (linear; 1 as bright as the light's strongest "
        "channel), move=X,Y,Z (metres), turn=X,Y,Z (degrees about x, then y, then z) and "
        "size=FACTOR changes. What moves a light has the scene's light computed anew; its "
        "brightness and colour do not.",
        "light changes as in lamp intensity=0.5 colour=1,0.8,0.6; 2 move=0,-0.2,0 turn=0,90,0 "
        "size=2, with finite numbers and no factor below 0"),
    property<&S::environment>(
        "environment",
        "Path of a picture of the light from all around: a Radiance .hdr file, or a PNG or JPEG "
        "file, equirectangular. It is seen where the scene ends, and lights it, in the place of "
        "assumed light. Empty: none. It comes as another scene does."),
    property<&S::environment_turn>("environment-turn",
                                   "By how much the environment is turned about the y axis, "
                                   "counter-clockwise seen from above, degrees, -360 to 360; at 0 "
                                   "the picture's middle is at +x. It comes as another scene does.",
                                   -360.0, 360.0),
    property<&S::environment_intensity>("environment-intensity",
                                        "Factor on the environment's brightness, 0 to 1000. In a "
                                        "scene without other light a change costs one new picture.",
                                        0.0, 1000.0),
    property<&S::light_intensity>(
        "light-intensity",
        "Factor on the brightness of all lights, 0 to 100. A change costs one new picture.", 0.0,
        100.0),
    property<&S::assumed_light>("assumed-light",
                                "Whether a scene without any light is lit by an assumed sky and "
                                "sun, as viewers do, and not dark."),
    property<&S::light_x>("light-x",
                          "How far the first light is moved along x, metres, -1000 to 1000. A "
                          "change has the scene's light computed anew.",
                          -1000.0, 1000.0),
    property<&S::light_y>("light-y",
                          "How far the first light is moved upwards, metres, -1000 to 1000. A "
                          "change has the scene's light computed anew.",
                          -1000.0, 1000.0),
    property<&S::light_z>("light-z",
                          "How far the first light is moved along z, metres, -1000 to 1000. A "
                          "change has the scene's light computed anew.",
                          -1000.0, 1000.0),
    property<&S::exposure_compensation>("exposure-compensation",
                                        "How many stops the picture is exposed longer than the "
                                        "scene says, -10 to 10: 1 makes it twice as bright.",
                                        -10.0, 10.0),
    property<&S::refinement>("refinement",
                             "When a view that stands still is traced towards the exact picture."),
    property<&S::samples>("samples",
                          "Samples per pixel after which a still view counts as exact and is only "
                          "repeated, 0 to 65536.",
                          0.0, 65536.0),
    property<&S::method>("method", "How a new view is drawn."),
    property<&S::smoothing>(
        "smoothing",
        "Of method rays: difference of neighbouring pixels, as a share of white, above which they "
        "are drawn with eight rays instead of one, 0 (all) to 1 (none).",
        0.0, 1.0),
    property<&S::light_spacing>(
        "light-spacing",
        "Distance between the points at which the light on the scene is kept, metres, 0.001 to 10. "
        "Smaller: sharper shadows close to what throws them, and a longer start.",
        0.001, 10.0, Change::when_ready),
    property<&S::light_cache>(
        "light-cache",
        "Whether the light on the scene, which takes seconds to compute, and the pictures of the "
        "built-in room are kept in files in the folder polyhull/light of the user's cache folder, "
        "and found there the next time.",
        0, 0, Change::when_ready),
    property<&S::progressive>(
        "progressive",
        "Of a live source, where the light is not found in a file: whether the first picture shows "
        "a coarse light, a fraction of a second after the start, and better ones are faded in as "
        "they are computed. A source that is not live always waits for the exact light.",
        0, 0, Change::when_ready),
    property<&S::live>(
        "is-live",
        "Deliver frames at their time, and skip frames when late, instead of as fast as possible.",
        0, 0, Change::when_ready),
};

}  // namespace

std::span<const Property<SceneSettings>> scene_properties() {
  return table;
}

Camera scene_viewport(const SceneSettings& settings, const ViewportControl& control,
                      const std::optional<TrackedPose>& tracked, const KeyFrames* keys,
                      const Scene& scene, double seconds, int width, int height) {
  if (tracked) {
    Camera camera = camera_of(*tracked, width, height, settings.field_of_view);
    if (camera.distortion.empty()) camera.distortion = settings.distortion();
    return camera;
  }
  if (keys) {
    KeyFrames::View view = keys->at(seconds);
    view.pose = control.apply(view.pose);
    Camera camera = viewport_camera(view, width, height);
    camera.distortion = settings.distortion();
    return camera;
  }
  double fov = settings.field_of_view;
  ViewportPose pose = settings.pose();
  Vec3 up(0, 1, 0);
  if (settings.path == ViewportPath::orbit) {
    const double angle =
        (settings.orbit_start + settings.orbit_speed * seconds) * std::numbers::pi / 180.0;
    pose.eye = Vec3(pose.target.x + settings.orbit_radius * std::sin(angle), settings.orbit_height,
                    pose.target.z + settings.orbit_radius * std::cos(angle));
  } else if (!settings.camera.empty()) {
    std::string names;
    const Camera* found = nullptr;
    for (const Camera& camera : scene.cameras) {
      if (camera.name == settings.camera) found = &camera;
      names += (names.empty() ? "" : ", ") + camera.name;
    }
    if (found == nullptr) {
      throw Error(Error::Kind::not_found, "The scene '{}' has no camera called '{}'. {}",
                  scene.name, settings.camera,
                  names.empty()
                      ? "It has none (orthographic ones do not count); leave camera empty."
                      : "Set camera to one of its (" + names + ") or leave it empty.");
    }
    const Mat3 axes = glm::transpose(found->R);
    pose.eye = found->centre();
    // What the operator turns around is as far away as the property's target is.
    const double distance = std::max(glm::length(pose.target - pose.eye), 1e-3);
    pose.target = pose.eye + distance * axes[2];
    if (!control.changed()) up = -axes[1];
    fov = 2.0 * std::atan(0.5 * found->height / found->K[1][1]) * 180.0 / std::numbers::pi;
  }
  pose = control.apply(pose);
  Camera camera = look_at(pose.eye, pose.target, fov, width, height, up);
  camera.distortion = settings.distortion();
  return camera;
}

double time_of(int number, const Scene& scene, const SceneSettings& settings, double seconds) {
  return time_in(scene.animations->at(static_cast<std::size_t>(number) - 1), seconds,
                 settings.animation_loop);
}

FoundPose scene_pose(const SceneSettings& settings, const Scene& scene, double seconds) {
  static const std::vector<Animation> none;
  const std::vector<Animation>& animations = scene.animations ? *scene.animations : none;
  FoundPose found{{settings.nodes}, {}};
  const std::optional<int> number = find_animation(animations, settings.animation);
  if (!number) {
    std::vector<std::string> there;
    for (const Animation& animation : animations) there.push_back(animation.name);
    found.missing =
        missing_words(scene.name, "animation", "'" + settings.animation + "'", there, true);
  } else if (*number > 0 && !animations[static_cast<std::size_t>(*number) - 1].motions.empty()) {
    found.pose.animation = *number;
    found.pose.animation_time = time_of(*number, scene, settings, seconds);
  }
  return found;
}

std::string joined(const std::string& first, const std::string& second) {
  return first + (first.empty() || second.empty() ? "" : " ") + second;
}

float light_factor(const SceneSettings& settings, bool assumed) {
  return assumed && !settings.assumed_light ? 0.0f : static_cast<float>(settings.light_intensity);
}

SceneLights scene_lights(const SceneSettings& settings, const std::string& scene,
                         const Bounds& bounds, std::vector<Light> lights, bool assumed) {
  SceneLights out{lights, std::move(lights), {}};
  if (!settings.lights.empty()) {
    std::vector<LightChange> changes = parse_light_changes(settings.lights);
    out.missing = change_lights(changes, bounds, scene, out.lights);
    for (LightChange& change : changes) change.intensity = 1.0f, change.colour.reset();
    change_lights(changes, bounds, scene, out.undimmed);
  }
  for (Light& light : out.lights) light.radiance *= light_factor(settings, assumed);
  for (std::vector<Light>* of : {&out.lights, &out.undimmed})
    if (!of->empty())
      of->front().centre +=
          Vec3f(static_cast<float>(settings.light_x), static_cast<float>(settings.light_y),
                static_cast<float>(settings.light_z));
  return out;
}

}  // namespace polyhull::element
