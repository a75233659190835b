// SPDX-License-Identifier: LGPL-2.1-or-later
// Depth of field against paths traced through a thin lens.
#include "render/lens/depth_of_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "raytrace/path_tracer.h"
#include "render/processor/processor_renderer.h"
#include "studio/room/shapes.h"
#include "synthetic.h"

namespace polyhull {
namespace {

constexpr int width = 320, height = 180;

Camera viewport() {
  return look_at({0.3, 1.3, 4.2}, {0, 1.0, 0}, 42.0, width, height);
}

/// Surfaces that glow in colours of their own, so that paths are sharp where they end: a wall of tiles,
/// a floor of tiles, a pillar between eye and subject and one behind it.
Scene glowing_scene() {
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

Vec3f paint(const Vec3f& p) {
  return {0.4f + 0.35f * std::sin(9.0f * p.y), 0.25f + 0.2f * std::cos(11.0f * p.x), 0.12f};
}

Hull figure() {
  Hull hull;
  synthetic::add_ellipsoid(hull, {-0.1f, 0.9f, 0.0f}, {0.3f, 0.9f, 0.2f}, 24);
  synthetic::add_ellipsoid(hull, {0.3f, 1.3f, 0.2f}, {0.4f, 0.07f, 0.07f}, 16);
  return hull;
}

std::vector<TracedSubject> traced(const Hull& hull) {
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

double psnr(const Picture& a, const Picture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double d = static_cast<double>(a.pixels[i]) - b.pixels[i];
    sum += d * d;
  }
  return 10.0 * std::log10(255.0 * 255.0 * 0.75 * static_cast<double>(a.pixels.size()) / sum);
}

/// The scene, sharp, and the layers that depth of field is made of.
struct Stage {
  Hull hull = figure();
  Mesh mesh;
  TracedScene scene{glowing_scene()};
  Camera camera = viewport();
  Picture without, with;
  DepthLayers depths;

  Stage() {
    without = trace_picture(scene, camera, 64);
    scene.set_subjects(traced(hull));
    with = trace_picture(scene, camera, 64);
    mesh.hull = hull;
    RenderFrame frame;
    frame.width = width;
    frame.height = height;
    frame.viewport = camera;
    frame.scene = std::make_shared<const Scene>(glowing_scene());
    frame.subjects.push_back({&mesh, {}, 0});
    ProcessorRenderer renderer;
    depths.set(frame, renderer.plan(frame, {}));
  }
  Picture drawn(const ViewportLens& lens) const {
    Picture out{width, height, 4, std::vector<std::uint8_t>(with.pixels.size())};
    DepthOfField().apply(camera, lens, depths,
                         {without.pixels.data(), with.pixels.data(), 4 * width}, out.pixels.data(),
                         4 * width);
    return out;
  }
  Picture truth(const ViewportLens& lens) const {
    PathOptions paths;
    paths.aperture = static_cast<float>(lens.aperture);
    paths.focus_distance = static_cast<float>(lens.focus_distance);
    return trace_picture(scene, camera, 128, paths);
  }
  Picture truth_without(const ViewportLens& lens) {
    scene.set_subjects({});
    Picture out = truth(lens);
    scene.set_subjects(traced(hull));
    return out;
  }
};

const Stage& stage() {
  static const Stage made;
  return made;
}

ViewportLens lens_of(double aperture, double focus) {
  ViewportLens lens;
  lens.aperture = aperture;
  lens.focus_distance = focus;
  return lens;
}

/// For a look at them: in the folder that the environment names.
void keep(const Picture& picture, const std::string& name) {
  if (const char* folder = std::getenv("POLYHULL_KEEP"))
    save_picture(picture, std::string(folder) + "/" + name);
}

TEST(DepthOfField, DepthsAreTheScenes) {
  const Camera camera = viewport();
  const DepthLayers& depths = stage().depths;
  const auto at = [&](const Vec3& point) {
    const Vec2 p = camera.project_ideal(point).value();
    return static_cast<std::size_t>(std::lround(p.y)) * width +
           static_cast<std::size_t>(std::lround(p.x));
  };
  for (const Vec3& point : {Vec3(-1.8, 1.7, -4.0), Vec3(-0.56, 1.5, 1.72), Vec3(1.0, 0.0, 0.5)}) {
    EXPECT_NEAR(depths.scene()[at(point)] * camera.to_camera(point).z, 1.0, 0.01);
    EXPECT_EQ(depths.coverage()[at(point)], 0.0f);
  }
  const Vec3 belly(-0.1, 0.9, 0.2);
  EXPECT_NEAR(depths.subject()[at(belly)] * camera.to_camera(belly).z, 1.0, 0.01);
  EXPECT_EQ(depths.coverage()[at(belly)], 1.0f);
  EXPECT_LT(depths.scene()[at(belly)], depths.subject()[at(belly)]);
}

TEST(DepthOfField, IsSharpWhereTheLensIsClosed) {
  const Picture drawn = stage().drawn(lens_of(1e-6, 4.2));
  // Through linear light and back codes stay.
  EXPECT_EQ(drawn.pixels, stage().with.pixels);
}

TEST(DepthOfField, EvenSurfacesStayEven) {
  Stage even;
  std::fill(even.without.pixels.begin(), even.without.pixels.end(), std::uint8_t{140});
  even.with = even.without;
  const Picture drawn = even.drawn(lens_of(0.2, 2.5));
  for (std::size_t i = 0; i < drawn.pixels.size(); ++i) ASSERT_NEAR(drawn.pixels[i], 140, 1);
}

// With a background that has its depth of field, only the subject changes, and as the truth has it.
TEST(DepthOfField, TheSubjectAlone) {
  ViewportLens lens = lens_of(0.15, 8.2);
  lens.subject_only = true;
  Stage of;
  of.without = of.truth_without(lens);
  // The pinhole's subject over the blurred scene.
  for (std::size_t i = 0; i < of.with.pixels.size(); ++i) {
    const float a = of.depths.coverage()[i / 4];
    if (a == 0.0f) of.with.pixels[i] = of.without.pixels[i];
  }
  const Picture drawn = of.drawn(lens), truth = of.truth(lens);
  int changed_far = 0;
  for (std::size_t i = 0; i < drawn.pixels.size(); i += 4) {
    const auto x = static_cast<int>(i / 4 % width);
    if (x > 3 * width / 4)
      changed_far += !std::equal(&drawn.pixels[i], &drawn.pixels[i] + 4, &of.with.pixels[i]);
  }
  EXPECT_EQ(changed_far, 0);
  const double found = psnr(drawn, truth), sharp = psnr(of.with, truth);
  std::printf("subject alone: %.1f dB (sharp %.1f dB)\n", found, sharp);
  EXPECT_GE(found, sharp + 3.0);
}

struct Case {
  const char* name;
  double focus, aperture, least;
};

// Focus on the near pillar, the subject, and the wall.
TEST(DepthOfField, IsNearToTheTruth) {
  for (const Case& of : {Case{"pillar", 2.5, 0.05, 39.5}, Case{"subject", 4.2, 0.05, 37.5},
                         Case{"subject-wide", 4.2, 0.15, 38.0}, Case{"wall", 8.2, 0.05, 41.0},
                         Case{"wall-wide", 8.2, 0.15, 35.5}}) {
    const ViewportLens lens = lens_of(of.aperture, of.focus);
    const Picture drawn = stage().drawn(lens), truth = stage().truth(lens);
    const double found = psnr(drawn, truth), sharp = psnr(stage().with, truth);
    std::printf("%-12s focus %.1f m, aperture %.0f mm: %.1f dB (sharp %.1f dB)\n", of.name,
                of.focus, 1e3 * of.aperture, found, sharp);
    keep(drawn, std::string("dof-") + of.name + ".png");
    keep(truth, std::string("dof-") + of.name + "-truth.png");
    EXPECT_GE(found, of.least) << of.name;
    EXPECT_GE(found, sharp + 1.5) << of.name;
  }
}

}  // namespace
}  // namespace polyhull
