// SPDX-License-Identifier: LGPL-2.1-or-later
// A glowing scene with a subject, its layers, and paths traced through it as it is seen.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "builtin/shapes.h"
#include "raytrace/path_tracer.h"
#include "render/lens/depth_layers.h"
#include "render/lens/light_layers.h"
#include "render/processor/processor_renderer.h"
#include "support/picture_error.h"
#include "support/run_kind.h"
#include "synthetic.h"

namespace polyhull::test {

using synthetic::psnr;

constexpr int width = 320, height = 180;

inline Camera viewport() {
  return look_at({0.3, 1.3, 4.2}, {0, 1.0, 0}, 42.0, width, height);
}

/// Surfaces that glow in colours of their own, so that paths are sharp where they end: a wall of tiles,
/// a floor of tiles, a pillar between eye and subject and one behind it.
inline Scene glowing_scene() {
  Scene scene;
  const auto add = [&](SceneMesh mesh, const Vec3f& colour) {
    mesh.material = static_cast<int>(scene.materials.size());
    Material material;
    material.base_colour = Vec3f(0.0f);
    material.emission = colour;
    scene.materials.push_back(material);
    scene.meshes.push_back(std::move(mesh));
  };
  const auto tile = [](int i, int j) {
    return Vec3f((i + j) % 2 ? 0.75f : 0.08f, i % 3 ? 0.3f : 0.6f, j % 3 ? 0.15f : 0.5f);
  };
  for (int i = 0; i < 16; ++i)
    for (int j = 0; j < 10; ++j)
      add(parallelogram("wall", 0, {-4.0f + 0.5f * i, 0.5f * j, -4.0f}, {0.5f, 0, 0}, {0, 0.5f, 0}),
          tile(i, j));
  for (int i = 0; i < 16; ++i)
    for (int j = 0; j < 14; ++j)
      add(parallelogram("floor", 0, {-4.0f + 0.5f * i, 0, 3.0f - 0.5f * j}, {0.5f, 0, 0},
                        {0, 0, -0.5f}),
          tile(i, j + 1));
  add(box("near", 0, {-0.62f, 0, 1.6f}, {-0.5f, 2.5f, 1.72f}), {0.7f, 0.65f, 0.5f});
  add(box("far", 0, {0.5f, 0, -1.6f}, {0.75f, 2.5f, -1.35f}), {0.1f, 0.12f, 0.3f});
  scene.exposure = 1.0f;
  return scene;
}

inline Vec3f paint(const Vec3f& p) {
  return {0.4f + 0.35f * std::sin(9.0f * p.y), 0.25f + 0.2f * std::cos(11.0f * p.x), 0.12f};
}

inline Hull figure() {
  Hull hull;
  synthetic::add_ellipsoid(hull, {-0.1f, 0.9f, 0.0f}, {0.3f, 0.9f, 0.2f}, 24);
  synthetic::add_ellipsoid(hull, {0.3f, 1.3f, 0.2f}, {0.4f, 0.07f, 0.07f}, 16);
  return hull;
}

inline std::vector<TracedSubject> traced(const Hull& hull) {
  TracedSubject subject;
  subject.positions = hull.vertices;
  subject.triangles = hull.triangles;
  subject.colour = [&hull](std::uint32_t triangle, float u, float v, const Vec3f&) {
    const auto corner = [&](std::uint32_t k) {
      return hull.vertices[hull.triangles[3 * triangle + k]];
    };
    return paint(corner(0) + u * (corner(1) - corner(0)) + v * (corner(2) - corner(0)));
  };
  return {subject};
}

/// Paths of a picture that is held against a truth. The sanitized run leaves these cases out
/// (sanitized_long.txt) where it is not asked for all.
inline int all_paths() {
  return sanitized() && std::getenv("POLYHULL_LONG") == nullptr ? 4 : 64;
}

/// The scene, sharp, and the layers that depth of field is made of.
struct Stage {
  Hull hull = figure();
  Mesh mesh;
  TracedScene scene{glowing_scene()};
  Camera camera;
  Picture without, with;
  RenderFrame frame;
  RenderPlan plan;
  DepthLayers depths;

  /// \p paths: to each pixel; one where what is seen does not count.
  explicit Stage(const Camera& seen_from = viewport(), int paths = all_paths())
      : camera(seen_from) {
    without = trace_picture(scene, camera, paths);
    scene.set_subjects(traced(hull));
    with = trace_picture(scene, camera, paths);
    mesh.hull = hull;
    frame.width = width;
    frame.height = height;
    frame.viewport = camera;
    frame.scene = std::make_shared<const Scene>(glowing_scene());
    frame.subjects.push_back({&mesh, {}, 0});
    ProcessorRenderer renderer;
    plan = renderer.plan(frame, {});
    depths.set(frame, plan);
  }
  /// What \p blur makes of the sharp pictures' light.
  template <typename Blur>
  Picture drawn(const Blur& blur) const {
    Picture out{width, height, 4, std::vector<std::uint8_t>(with.pixels.size())};
    LightLayers sharp, blurred;
    sharp.read(depths, {without.pixels.data(), with.pixels.data(), 4 * width});
    blur(sharp, blurred);
    blurred.write(with.pixels.data(), 4 * width, out.pixels.data(), 4 * width);
    return out;
  }
};

/// For a look at them: in the folder that the environment names.
inline void keep(const Picture& picture, const std::string& name) {
  if (const char* folder = std::getenv("POLYHULL_KEEP"))
    save_picture(picture, std::string(folder) + "/" + name);
}

}  // namespace polyhull::test
