// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What a background's source says of each of its frames, so that composite draws with exactly the
/// camera, lights and scene that made the picture. It travels as a sticky serialised downstream
/// event named "polyhull-announcement" with one string field "json", sent before the first buffer
/// it is true for (docs/formats.md).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rig/camera.h"
#include "scene/animation/scene_pose.h"
#include "scene/scene.h"

namespace polyhull {

/// An environment picture, as load_environment() takes it.
struct EnvironmentFile {
  std::string name;   ///< its path; empty: none
  int version = 0;    ///< as Announcement::scene_version
  double turn = 0.0;  ///< degrees
  bool operator==(const EnvironmentFile&) const = default;
};

struct Announcement {
  Camera viewport;    ///< the camera of the picture; world = scene coordinates, metres
  std::string scene;  ///< name for open_scene(); empty: only the viewport is announced, and scene,
                      ///< lights, exposure and ambient are composite's own
  /// Of a file: how often it has been written anew and read again under this name; another one is
  /// another scene.
  int scene_version = 0;
  ScenePose pose;               ///< of its file
  EnvironmentFile environment;  ///< what is around the scene
  std::vector<Light> lights;    ///< the lights as they are in this frame
  /// The same and the sky as bright as the scene's file has them, by which the studio's light is known (SubjectLight);
  /// no lights and none: as they are.
  std::vector<Light> undimmed;
  std::optional<Vec3f> undimmed_sky;
  float exposure = 1.0f;  ///< as in Scene
  Vec3f ambient{0.0f};    ///< mean indirect irradiance over the scene's surfaces
  Vec3f sky{0.0f};        ///< as in Scene
  /// As in ViewportLens, of the viewport's real lens where that is known; 0: it is not. The picture need
  /// not have it.
  double aperture = 0.0, focus_distance = 0.0;
  double depth_near = 0.0;  ///< metres that the largest value of a depth video beside the picture
                            ///< stands for (docs/formats.md); 0: there is none
};

std::string announcement_to_json(const Announcement& announcement);

/// Throws Error on text that is not an announcement, or one that nothing can be drawn with
/// (drawable.h).
Announcement parse_announcement(std::string_view json);

}  // namespace polyhull
