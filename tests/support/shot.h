// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// One composite of a plain scene over an even background, pixel by pixel, for tests of rendering.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "backend.h"
#include "simple_trace.h"
#include "synthetic.h"

namespace polyhull::synthetic {

/// A floor at y = 0 with one lamp, no ambient light.
inline Scene floor_scene(const Material& material, const Light& lamp) {
  Scene scene;
  scene.name = "test:floor";
  scene.materials = {material};
  SceneMesh floor;
  floor.positions = {{-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4}};
  floor.normals.assign(4, Vec3f(0, 1, 0));
  floor.triangles = {0, 1, 2, 0, 2, 3};
  scene.meshes = {floor};
  scene.lights = {lamp};
  scene.mirrors = find_mirrors(scene);
  return scene;
}

/// A box that shows its one colour (sRGB, 0..1) from everywhere.
inline Mesh plain_box(const Vec3f& low, const Vec3f& high, float value) {
  Mesh mesh;
  add_box(mesh.hull, low, high);
  mesh.texturing.emplace();
  mesh.texturing->untextured = Vec3f(value);
  return mesh;
}

/// One composite over a background of one value (linear).
struct Shot {
  RenderFrame frame;
  RenderSettings settings;
  Picture picture;

  Shot(Scene scene, const Mesh& mesh, const Camera& viewport) {
    frame.width = viewport.width;
    frame.height = viewport.height;
    frame.viewport = viewport;
    frame.lights = scene.lights;
    frame.exposure = scene.exposure;
    frame.scene = std::make_shared<const Scene>(std::move(scene));
    frame.subjects.push_back({&mesh, {}, 0});
  }
  /// Returns the background's value as its eight bits hold it.
  float draw(float background) {
    const auto value = static_cast<std::uint8_t>(std::lround(255.0f * to_srgb(background)));
    draw(Picture{frame.width, frame.height, 4,
                 std::vector<std::uint8_t>(static_cast<std::size_t>(frame.width) * frame.height * 4,
                                           value)});
    return to_linear(value / 255.0f);
  }
  void draw(const Picture& before) {
    picture = before;
    const auto renderer = polyhull::testing::BackendTest::make_renderer();
    renderer->render(frame, renderer->plan(frame, settings), settings, before.pixels.data(),
                     4 * frame.width, picture.pixels.data(), 4 * frame.width);
  }
  const std::uint8_t* pixel(const Vec3& point) const {
    const Vec2 p = frame.viewport.project_ideal(point).value();
    const int x = static_cast<int>(std::lround(p.x)), y = static_cast<int>(std::lround(p.y));
    EXPECT_TRUE(x >= 0 && x < frame.width && y >= 0 && y < frame.height) << p.x << " " << p.y;
    return &picture.pixels[4 * (static_cast<std::size_t>(y) * frame.width + x)];
  }
  /// The linear value of the pixel that shows \p point.
  Vec3f at(const Vec3& point) const {
    const std::uint8_t* p = pixel(point);
    return {to_linear(p[0] / 255.0f), to_linear(p[1] / 255.0f), to_linear(p[2] / 255.0f)};
  }
};

inline Light point_lamp(const Vec3f& centre, const Vec3f& intensity) {
  Light lamp;
  lamp.centre = centre;
  lamp.radiance = intensity;
  return lamp;
}

}  // namespace polyhull::synthetic
