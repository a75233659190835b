// SPDX-License-Identifier: LGPL-2.1-or-later
#include "rig/lens.h"

#include <gtest/gtest.h>

#include <random>

#include "rig/rig.h"
#include "rig/undistort.h"

namespace polyhull {
namespace {

// Camera 1 of the Utrecht room: its corners lie outside the model's invertible disk.
Camera barrel() {
  Camera camera;
  camera.name = "barrel";
  camera.width = 644;
  camera.height = 486;
  camera.K = from_rows({490.756439, 0, 334.690674, 0, 493.26358, 222.39888, 0, 0, 1});
  camera.distortion = {-0.368704915, 0.203186616, 0.000326540467, 1.78072587e-05, -0.0712014362};
  return camera;
}

TEST(Lens, FormulaByHand) {
  Camera camera = barrel();
  camera.distortion = {0.1,   0.01,   0.002, 0.003, 0.001, 0.02,
                       0.003, 0.0004, 0.005, 0.006, 0.007, 0.008};
  const double x = 0.3, y = -0.2, s = x * x + y * y;
  const double q = (1 + 0.1 * s + 0.01 * s * s + 0.001 * s * s * s) /
                   (1 + 0.02 * s + 0.003 * s * s + 0.0004 * s * s * s);
  const double dx = x * q + 2 * 0.002 * x * y + 0.003 * (s + 2 * x * x) + 0.005 * s + 0.006 * s * s;
  const double dy = y * q + 0.002 * (s + 2 * y * y) + 2 * 0.003 * x * y + 0.007 * s + 0.008 * s * s;
  const auto pixel = [&](double u, double v) {
    return Vec2(camera.K[0][0] * u + camera.K[2][0], camera.K[1][1] * v + camera.K[2][1]);
  };
  EXPECT_LT(glm::length(camera.distort(pixel(x, y)) - pixel(dx, dy)), 1e-10);
}

TEST(Lens, InverseInsideTheDisk) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> pick(-1.0, 1.0);
  int tried = 0;
  for (int model = 0; model < 200; ++model) {
    Camera camera = barrel();
    camera.K[1][0] = 3.0 * pick(random);
    const int counts[] = {4, 5, 8, 12};
    camera.distortion.assign(counts[model % 4], 0.0);
    const double sizes[] = {0.4, 0.3, 2e-3, 2e-3, 0.1, 0.2, 0.1, 0.05, 2e-3, 2e-3, 2e-3, 2e-3};
    for (std::size_t i = 0; i < camera.distortion.size(); ++i)
      camera.distortion[i] = sizes[i] * pick(random);
    const Lens lens(camera);
    ASSERT_GT(lens.invertible_radius(), 0.0);
    for (int i = 0; i < 100; ++i) {
      const double radius = 0.9 * std::min(lens.invertible_radius(), 1.2) * std::abs(pick(random));
      const double angle = 3.14159 * pick(random);
      const double y = radius * std::sin(angle);
      const Vec2 ideal(
          camera.K[0][0] * radius * std::cos(angle) + camera.K[1][0] * y + camera.K[2][0],
          camera.K[1][1] * y + camera.K[2][1]);
      const Vec2 real = lens.distort(ideal);
      ASSERT_LT(glm::length(lens.distort(lens.undistort(real)) - real), 1e-9);
      // Near the rim the map is almost flat, so only well inside is the original pinned down.
      ASSERT_LT(glm::length(lens.undistort(real) - ideal), 1e-6) << model << " " << radius;
      ++tried;
    }
  }
  EXPECT_EQ(tried, 20000);
}

TEST(Lens, OutsideTheDiskTheRimIsUsed) {
  const Camera camera = barrel();
  const Lens lens(camera);
  EXPECT_LT(lens.invertible_radius(), 2.0);
  for (const Vec2 corner : {Vec2(-0.5, -0.5), Vec2(643.5, -0.5), Vec2(643.5, 485.5),
                            Vec2(-0.5, 485.5), Vec2(5000, -7000), Vec2(1e9, 1e9)}) {
    const Vec2 ideal = lens.undistort(corner);
    ASSERT_TRUE(std::isfinite(ideal.x) && std::isfinite(ideal.y));
    const double x = (ideal.x - camera.K[2][0]) / camera.K[0][0];
    const double y = (ideal.y - camera.K[2][1]) / camera.K[1][1];
    const double radius = std::hypot(x, y);
    EXPECT_LE(radius, lens.invertible_radius() * (1 + 1e-9));
    // No other point of the rim has a nearer image (in normalised coordinates).
    const auto distance = [&](double angle) {
      const Vec2 rim(camera.K[0][0] * radius * std::cos(angle) + camera.K[2][0],
                     camera.K[1][1] * radius * std::sin(angle) + camera.K[2][1]);
      const Vec2 d = lens.distort(rim) - corner;
      return std::hypot(d.x / camera.K[0][0], d.y / camera.K[1][1]);
    };
    if (radius > lens.invertible_radius() * (1 - 1e-6)) {
      const double best = distance(std::atan2(y, x));
      for (int i = 0; i < 360; ++i) EXPECT_GE(distance(i * 3.14159265 / 180), best - 1e-6);
    }
  }
}

TEST(Lens, NoDistortionIsTheIdentity) {
  Camera camera = barrel();
  camera.distortion = {0, 0, 0, 0};
  EXPECT_FALSE(camera.has_distortion());
  EXPECT_EQ(camera.undistort(Vec2(3.25, 4.5)), Vec2(3.25, 4.5));
  EXPECT_EQ(camera.distort(Vec2(3.25, 4.5)), Vec2(3.25, 4.5));
  Rings rings;
  rings.points = {{1, 1}, {1, 400}, {600, 400}};
  rings.ends = {3};
  const UndistortedRings out = undistort_rings(camera, rings);
  EXPECT_EQ(out.rings, rings);
  EXPECT_EQ(out.source, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(Undistort, CurvesStayWithinTheDeviation) {
  const Camera camera = barrel();
  const Lens lens(camera);
  Rings rings;
  rings.points = {{100, 60}, {80, 420}, {560, 400}, {520, 50}, {300, 200}, {320, 200}, {310, 230}};
  rings.ends = {4, 7};
  std::size_t last_count = 0;
  for (const double deviation : {1.0, 0.1, 0.01}) {
    const UndistortedRings out = undistort_rings(camera, rings, deviation);
    ASSERT_EQ(out.rings.size(), 2u);
    ASSERT_EQ(out.source.size(), out.rings.points.size());
    EXPECT_GT(out.rings.points.size(), last_count);
    last_count = out.rings.points.size();
    // Each point of each real edge lies, undistorted, near the polygon's edges made from it.
    for (std::size_t ring = 0; ring < 2; ++ring) {
      const std::size_t begin = ring == 0 ? 0 : rings.ends[ring - 1];
      const std::size_t out_begin = ring == 0 ? 0 : out.rings.ends[ring - 1];
      const std::size_t out_end = out.rings.ends[ring];
      for (std::size_t i = begin; i < rings.ends[ring]; ++i) {
        const Vec2 a(rings.points[i]);
        const Vec2 b(rings.points[i + 1 == rings.ends[ring] ? begin : i + 1]);
        for (double t = 0.0; t <= 1.0; t += 0.01) {
          const Vec2 truth = lens.undistort(glm::mix(a, b, t));
          double nearest = 1e9;
          for (std::size_t j = out_begin; j < out_end; ++j) {
            if (out.source[j] != i) continue;
            const Vec2 p(out.rings.points[j]);
            const Vec2 q(out.rings.points[j + 1 == out_end ? out_begin : j + 1]);
            const double s =
                glm::clamp(glm::dot(truth - p, q - p) / glm::dot(q - p, q - p), 0.0, 1.0);
            nearest = std::min(nearest, glm::length(truth - glm::mix(p, q, s)));
          }
          ASSERT_LT(nearest, deviation * 1.1 + 1e-4);
        }
      }
    }
  }
}

TEST(Undistort, EmptyRings) {
  EXPECT_TRUE(undistort_rings(barrel(), {}).rings.empty());
}

}  // namespace
}  // namespace polyhull
