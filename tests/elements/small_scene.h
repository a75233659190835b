// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A scene that is quick to light.
#pragma once

#include <string>

#include "builtin/shapes.h"
#include "scene/scene.h"

namespace polyhull::test {

/// Writes a red box on a mirror floor under a lamp, and a camera, to \p path; returns that.
inline std::string write_small_scene(const std::string& path) {
  Scene scene;
  scene.materials.resize(3);
  scene.materials[0].base_colour = {0.8f, 0.1f, 0.1f};
  scene.materials[1].base_colour = {0.2f, 0.3f, 0.5f};
  scene.materials[1].roughness = 0.0f;
  scene.materials[2].emission = Vec3f(8.0f);
  scene.meshes = {box("box", 0, {-0.3f, 0, -0.3f}, {0.3f, 0.6f, 0.3f}),
                  parallelogram("floor", 1, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2}),
                  parallelogram("lamp", 2, {-0.5f, 2, -0.5f}, {1, 0, 0}, {0, 0, 1})};
  scene.exposure = 0.7f;
  scene.cameras = {look_at({0, 3, 0.1}, {0, 0, 0}, 40, 1280, 720)};
  scene.cameras[0].name = "above";
  save_scene(scene, path);
  return path;
}

}  // namespace polyhull::test
