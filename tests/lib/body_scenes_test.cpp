// SPDX-License-Identifier: LGPL-2.1-or-later
// The yardstick for surfaces made from silhouettes: its own error is far below what it measures.
#include "support/body_scenes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "hull/build/stage.h"
#include "hull/measure.h"

namespace polyhull::test {
namespace {

/// A square of \p size at \p height, in 2 n^2 triangles.
TriangleSurface square(double size, double height, int n) {
  TriangleSurface surface;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) surface.vertices.emplace_back(i * size / n, height, j * size / n);
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto at = static_cast<std::uint32_t>(j * (n + 1) + i);
      const auto below = at + static_cast<std::uint32_t>(n) + 1;
      surface.triangles.push_back({at, below, at + 1});
      surface.triangles.push_back({at + 1, below, below + 1});
    }
  }
  return surface;
}

Hull hull_from(const TriangleSurface& surface) {
  Hull hull;
  hull.vertices.assign(surface.vertices.begin(), surface.vertices.end());
  for (const auto& t : surface.triangles) {
    hull.triangles.insert(hull.triangles.end(), t.begin(), t.end());
  }
  return hull;
}

Body figure(double seconds) {
  return {"figure", open_subject("figure"), seconds};
}

TEST(SurfaceDistance, OfParallelSquares) {
  const SurfaceDistance d = distance_between(square(1.0, 0.3, 7), square(1.0, 0.1, 3), 5000);
  EXPECT_NEAR(d.mean, 0.2, 1e-6);
  EXPECT_NEAR(d.p95, 0.2, 1e-6);
  EXPECT_NEAR(d.greatest, 0.2, 1e-6);
}

TEST(SurfaceDistance, BeyondTheBorder) {
  // Of a square of side 2 to one of side 1 at its corner, both in one plane. The distance d lies in
  // a quarter disk and two strips: means by integration over the four quarters.
  const SurfaceDistance d = distance_between(square(2.0, 0.0, 5), square(1.0, 0.0, 2), 40000);
  const double corner = (std::sqrt(2.0) + std::asinh(1.0)) / 3.0;  // mean over the unit square
  EXPECT_NEAR(d.mean, (0.0 + 0.5 + 0.5 + corner) / 4.0, 2e-3);
  EXPECT_NEAR(d.greatest, std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(distance_between(square(1.0, 0.0, 2), square(2.0, 0.0, 5), 1000).greatest, 0.0, 1e-6);
}

TEST(SurfaceDistance, SamplesByArea) {
  // One large triangle and one small one far away: 5 % of the area is not reached by p95.
  TriangleSurface from = square(1.0, 0.0, 1);
  from.vertices.insert(from.vertices.end(), {{5.0, 0.0, 0.0}, {5.0, 0.0, 0.2}, {5.4, 0.0, 0.0}});
  from.triangles.push_back({4, 5, 6});  // area 0.04 of 1.04
  const SurfaceDistance d = distance_between(from, square(1.0, 0.0, 1), 10000);
  EXPECT_LT(d.p95, 1e-6);
  EXPECT_NEAR(d.mean, 0.04 / 1.04 * (4.0 + 0.4 / 3.0), 2e-3);
  EXPECT_NEAR(d.greatest, 4.4, 1e-6);
}

TEST(SurfaceDistance, OfNothing) {
  EXPECT_TRUE(std::isinf(distance_between(square(1.0, 0.0, 1), {}, 10).mean));
  EXPECT_EQ(distance_between({}, square(1.0, 0.0, 1), 10).mean, 0.0);
}

TEST(BodyScenes, TheTruthHasNoError) {
  const BodyScene scene = body_scene(body_rig("4far"), figure(3.0));
  ASSERT_EQ(scene.cameras.size(), 4u);
  const BodyError error = measure(hull_from(scene.truth), scene, true);
  EXPECT_EQ(error.unsound, 0.0);
  EXPECT_NEAR(error.volume, 1.0, 1e-6);
  EXPECT_LT(error.mean, 1e-3);
  EXPECT_LT(error.hausdorff, 1e-3);
  EXPECT_GT(error.overlap, 0.9999);
  // What the contours' tolerance of half a pixel moves.
  EXPECT_LT(error.missing, 0.006);
  EXPECT_LT(error.outside, 0.006);
  // What no camera sees, and what is interpolated between pictures.
  EXPECT_GT(error.psnr, 24.0);
}

TEST(BodyScenes, CamerasBetween) {
  const BodyScene scene = body_scene(body_rig("4far"), figure(0.0));
  // 45, 157.5, 270 and 337.5 degrees from +x towards +z.
  const Vec3 first = scene.between[0].centre(), third = scene.between[2].centre();
  EXPECT_NEAR(first.x, 3.0 * std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(first.z, 3.0 * std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(first.y, 1.2, 1e-9);
  EXPECT_NEAR(third.x, 0.0, 1e-9);
  EXPECT_NEAR(third.z, -3.0, 1e-9);
}

TEST(BodyScenes, TheHullCoversAndIsTooLarge) {
  const BodyScene scene = body_scene(body_rig("8"), figure(3.0));
  HullStage stage;
  const Hull& hull = hull_of(scene, stage, 1);
  ASSERT_TRUE(is_closed(hull));
  const BodyError error = measure(hull, scene, true);
  EXPECT_NEAR(error.volume, 1.154, 0.01);
  EXPECT_NEAR(error.mean, 5.7, 0.3);
  EXPECT_NEAR(error.hausdorff, 31.0, 3.0);
  EXPECT_NEAR(error.overlap, 0.932, 0.005);
  EXPECT_NEAR(distance_mm(surface_of(hull), scene.truth), error.mean, 1e-9);
  EXPECT_LT(error.missing, 0.0015);
  EXPECT_LT(error.outside, 0.0001);
  EXPECT_NEAR(error.psnr, 20.0, 1.0);
}

TEST(BodyScenes, ASurfaceThatLeavesItsSilhouettes) {
  const BodyScene scene = body_scene(body_rig("4far"), figure(0.0));
  HullStage stage;
  Hull hull = hull_of(scene, stage, 1);
  for (Vec3f& v : hull.vertices) v.y += 0.01f;  // 1 cm up: the head leaves, the soles are missing
  const BodyError error = measure(hull, scene, false);
  EXPECT_GT(error.missing, 0.01);
  EXPECT_GT(error.outside, 0.01);
  EXPECT_EQ(error.psnr, 0.0);
  hull.triangles.resize(hull.triangles.size() - 3);
  EXPECT_EQ(measure(hull, scene, false).unsound, 1.0);
}

TEST(BodyScenes, NoiseMovesTheHull) {
  const BodyScene scene = body_scene(body_rig("4"), figure(7.0), false);
  EXPECT_TRUE(scene.seen.empty());
  HullStage stage;
  const TriangleSurface hull = surface_of(hull_of(scene, stage, 1));
  EXPECT_EQ(with_noise(scene, 0.0, 1).contours, scene.contours);
  EXPECT_EQ(with_noise(scene, 0.5, 1).contours, with_noise(scene, 0.5, 1).contours);
  EXPECT_NE(with_noise(scene, 0.5, 1).contours, with_noise(scene, 0.5, 2).contours);
  // A pixel is 4.3 mm on the body: noise across the contours moves the hull by half a pixel's
  // mean absolute deviation, 0.8 of 2.1 mm, where vertices are, and less between them.
  const BodyScene noisy = with_noise(scene, 0.5, 1);
  const double moved = distance_mm(hull, surface_of(hull_of(noisy, stage, 1)));
  EXPECT_GT(moved, 1.0);
  EXPECT_LT(moved, 1.7);
  const double more = distance_mm(hull, surface_of(hull_of(with_noise(scene, 1.0, 1), stage, 1)));
  EXPECT_NEAR(more / moved, 2.0, 0.3);
}

/// A square of one metre across the stage's axis, its middle where the camera looks, facing it.
struct FacingSquare {
  Camera camera = body_rig("4").cameras[0];
  TriangleSurface surface;

  FacingSquare() {
    const Mat3 turn = glm::transpose(camera.R);
    const double depth = camera.to_camera({0.0, 0.95, 0.0}).z;
    for (const Vec2 corner : {Vec2(-0.5, -0.5), Vec2(-0.5, 0.5), Vec2(0.5, 0.5), Vec2(0.5, -0.5)})
      surface.vertices.push_back(camera.centre() + turn * Vec3(corner, depth));
    surface.triangles = {{0, 1, 2},
                         {0, 2, 3}};  // counter-clockwise for the camera, whose y is down
  }
};

TEST(BodyScenes, CoverageOfASquare) {
  const FacingSquare square;
  const Picture coverage = coverage_of(square.surface, square.camera);
  const double side = 700.0 / square.camera.to_camera({0.0, 0.95, 0.0}).z;
  double area = 0.0;
  for (const std::uint8_t value : coverage.pixels) area += value / 255.0;
  EXPECT_NEAR(area / (side * side), 1.0, 0.001);
  EXPECT_EQ(coverage.row(384)[512], 255);
  EXPECT_EQ(coverage.row(384)[512 + static_cast<int>(0.5 * side) + 2], 0);
}

TEST(BodyScenes, PlasterIsLitFromBesideTheCamera) {
  FacingSquare square;
  const Picture lit = plaster(square.surface, square.camera);
  // The lamp stands in the direction (-0.5, -0.6, -1) of the camera's axes.
  const double facing = 1.0 / std::sqrt(0.25 + 0.36 + 1.0);
  EXPECT_NEAR(lit.row(384)[3 * 512], 30.0 + 215.0 * facing, 1.0);
  EXPECT_EQ(lit.row(10)[0], 24);
}

TEST(BodyScenes, BodiesWithoutData) {
  const std::vector<Body> bodies = study_bodies("/nowhere");
  ASSERT_EQ(bodies.size(), 3u);
  EXPECT_EQ(bodies[1].name, "figure-3");
  EXPECT_EQ(bodies[1].seconds, 3.0);
}

TEST(BodyScenes, NoSuchRig) {
  EXPECT_THROW(body_rig("five"), Error);
  EXPECT_THROW(body_rig("1"), Error);
  EXPECT_EQ(body_rig("5").cameras.size(), 5u);
}

}  // namespace
}  // namespace polyhull::test
