// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/approximate.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "silhouette/blur.h"
#include "silhouette_checks.h"

namespace polyhull {
namespace {

struct Traced {
  Rings rings;
  std::vector<std::int32_t> parents;
};

Traced trace(const Matte& matte, double sigma) {
  Blur blur;
  BlurSettings settings;
  settings.sigma = sigma;
  blur.set(settings);
  Field field;
  blur.apply(matte, field);
  Tracer tracer;
  Traced out;
  tracer.trace(field, {TraceMethod::subpixel, sigma}, out.rings, &out.parents);
  return out;
}

Rings approximate(const Traced& traced, const ApproximateSettings& settings) {
  Approximator approximator;
  Rings out;
  approximator.approximate(traced.rings, traced.parents, settings, out);
  return out;
}

// Everything that is promised of a result.
void expect_sound(const Rings& traced, const Rings& result, double tolerance) {
  EXPECT_TRUE(test::simple_and_disjoint(result));
  EXPECT_TRUE(test::well_nested(result));
  (void)traced;
  (void)tolerance;
}

double star_radius(double angle, double radius) {
  return radius * (1.0 + 0.25 * std::sin(5.0 * angle) + 0.08 * std::cos(11.0 * angle));
}

Matte star(int size, double radius) {
  return test::draw(size, size, [&](int x, int y) {
    const double dx = x - size / 2 + 0.3, dy = y - size / 2 - 0.2;
    const double d = star_radius(std::atan2(dy, dx), radius) - std::hypot(dx, dy);
    if (std::abs(d) > 4.0) return d > 0 ? 255 : 0;
    return test::coverage(x, y, [&](double u, double v) {
      const double ex = u - size / 2 + 0.3, ey = v - size / 2 - 0.2;
      return std::hypot(ex, ey) < star_radius(std::atan2(ey, ex), radius);
    });
  });
}

TEST(Approximate, StarWithinTolerance) {
  const Traced traced = trace(star(760, 250.0), 2.0);
  ASSERT_EQ(traced.rings.size(), 1u);
  const double area = test::total_area(traced.rings);
  double length = 0.0;
  for (const auto& s : test::segments_of(traced.rings))
    length += std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
  std::printf("%9s %8s %9s %9s\n", "tolerance", "vertices", "hausdorff", "bias");
  for (const double tolerance : {0.5, 1.0, 2.0, 4.0}) {
    ApproximateSettings settings;
    settings.tolerance = tolerance;
    const Rings result = approximate(traced, settings);
    ASSERT_EQ(result.size(), 1u);
    EXPECT_TRUE(test::simple_and_disjoint(result));
    const double there = test::one_sided_distance(traced.rings, result, 0.3);
    const double back = test::one_sided_distance(result, traced.rings, 0.3);
    const double bias = (test::total_area(result) - area) / length;
    std::printf("%9g %8zu %9.4f %+9.4f\n", tolerance, result.points.size(), std::max(there, back),
                bias);
    EXPECT_LE(std::max(there, back), tolerance);
    EXPECT_LE(std::abs(bias), 0.05);
  }
}

TEST(Approximate, RandomMasksStaySimple) {
  std::mt19937 random(11);
  for (int round = 0; round < 60; ++round) {
    const int w = 20 + static_cast<int>(random() % 100), h = 20 + static_cast<int>(random() % 60);
    const unsigned density = 2 + random() % 7;
    const int block = 1 + static_cast<int>(random() % 4);
    std::vector<bool> cells(static_cast<std::size_t>(w) * h);
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = random() % 10 < density;
    const Matte mask = test::draw(w, h, [&](int x, int y) {
      return cells[static_cast<std::size_t>(y / block) * w + x / block] ? 255 : 0;
    });
    const Traced traced = trace(mask, std::array{0.0, 0.7, 2.0}[random() % 3]);
    ApproximateSettings settings;
    settings.tolerance = std::array{0.3, 1.0, 2.0, 5.0, 20.0}[random() % 5];
    settings.min_edges = 3;
    settings.min_area = std::array{0.0, 4.0, 50.0}[random() % 3];
    settings.min_hole_area = std::array{0.0, 4.0}[random() % 2];
    const Rings result = approximate(traced, settings);
    expect_sound(traced.rings, result, settings.tolerance);
    // What was kept lies within the tolerance of what was traced.
    EXPECT_LE(test::one_sided_distance(result, traced.rings, 0.5), settings.tolerance + 1e-9);
    if (settings.min_area == 0.0 && settings.min_hole_area == 0.0) {
      EXPECT_EQ(result.size(), traced.rings.size());
      EXPECT_LE(test::one_sided_distance(traced.rings, result, 0.5), settings.tolerance + 1e-9);
    }
    if (::testing::Test::HasFailure()) {
      std::printf("round %d: %dx%d, tolerance %g, block %d\n", round, w, h, settings.tolerance,
                  block);
      return;
    }
  }
}

TEST(Approximate, CombsSpiralsAndThinWalls) {
  const int size = 64;
  std::vector<Matte> mattes;
  mattes.push_back(
      test::draw(size, size, [](int x, int y) { return y > 3 && y < 75 && x % 2 == 0 ? 255 : 0; }));
  mattes.push_back(test::draw(
      size, size, [](int x, int y) { return y > 70 || (y > 3 && x % 4 < 2) ? 255 : 0; }));
  mattes.push_back(test::draw(size, size, [&](int x, int y) {
    const double r = std::hypot(x - 40.2, y - 39.7), a = std::atan2(y - 39.7, x - 40.2);
    return r < 38 && std::fmod(r + 4.0 * (a / M_PI + 1.0), 8.0) < 4.0 ? 255 : 0;
  }));
  mattes.push_back(test::draw(size, size, [](int x, int y) { return (x + y) % 2 ? 255 : 0; }));
  mattes.push_back(test::draw(size, size, [](int x, int y) {
    const double r = std::hypot(x - 40, y - 40);
    return r < 36 && std::abs(r - 30) > 1.2 && std::abs(r - 25) > 1.2 ? 255 : 0;
  }));
  for (std::size_t i = 0; i < mattes.size(); ++i)
    for (const double tolerance : {0.5, 2.0, 8.0}) {
      ApproximateSettings settings;
      settings.tolerance = tolerance;
      settings.min_edges = 3;
      settings.min_area = 0.0;
      const Traced traced = trace(mattes[i], 0.5);
      const Rings result = approximate(traced, settings);
      EXPECT_EQ(result.size(), traced.rings.size());
      expect_sound(traced.rings, result, tolerance);
      EXPECT_LE(test::one_sided_distance(result, traced.rings, 0.5), tolerance + 1e-9) << i;
      EXPECT_LE(test::one_sided_distance(traced.rings, result, 0.5), tolerance + 1e-9) << i;
    }
}

TEST(Approximate, DropsBySizeWithWhatIsInside) {
  // A large ring with a hole, in it an island; a small ring with a hole; a speck.
  const Matte m = test::draw(200, 120, [](int x, int y) {
    const double a = std::hypot(x - 60, y - 60), b = std::hypot(x - 160, y - 60);
    return a < 8 || (a > 20 && a < 50) || (b > 6 && b < 14) ||
                   (x > 190 && y > 110 && x < 194 && y < 114)
               ? 255
               : 0;
  });
  const Traced traced = trace(m, 0.5);
  ASSERT_EQ(traced.rings.size(), 6u);
  ApproximateSettings settings;
  settings.tolerance = 0.5;
  settings.min_area = 0.0;
  EXPECT_EQ(approximate(traced, settings).size(), 6u);
  settings.min_area = 50.0;
  EXPECT_EQ(approximate(traced, settings).size(), 5u);
  settings.keep_largest = 1;
  EXPECT_EQ(approximate(traced, settings).size(), 2u);
  settings.keep_largest = 2;
  EXPECT_EQ(approximate(traced, settings).size(), 4u);
  settings.keep_largest = 0;
  settings.min_hole_area = 500.0;
  EXPECT_EQ(approximate(traced, settings).size(), 4u) << "the small ring's hole is filled";
  settings.min_hole_area = 5000.0;
  EXPECT_EQ(approximate(traced, settings).size(), 2u) << "a filled hole's island goes with it";

  // Without the tracer's parents the answer is the same.
  Approximator approximator;
  Rings with, without;
  approximator.approximate(traced.rings, traced.parents, settings, with);
  approximator.approximate(traced.rings, {}, settings, without);
  EXPECT_EQ(with, without);
}

TEST(Approximate, ZeroToleranceKeepsTheTrace) {
  const Traced traced = trace(star(120, 40.0), 1.0);
  ApproximateSettings settings;
  settings.tolerance = 0.0;
  EXPECT_EQ(approximate(traced, settings), traced.rings);
}

TEST(Approximate, SquareHasFewCorners) {
  const Matte m = test::draw(
      200, 200, [](int x, int y) { return x >= 40 && x < 160 && y >= 50 && y < 150 ? 255 : 0; });
  ApproximateSettings settings;
  settings.tolerance = 2.0;
  const Rings result = approximate(trace(m, 1.0), settings);
  ASSERT_EQ(result.size(), 1u);
  EXPECT_LE(result.points.size(), 5u);
  EXPECT_NEAR(test::total_area(result), 120.0 * 100.0, 60.0);
}

TEST(Approximate, RefusesNonsense) {
  Approximator approximator;
  Rings out;
  for (const double tolerance : {-1.0, 101.0, std::nan("")}) {
    ApproximateSettings settings;
    settings.tolerance = tolerance;
    EXPECT_THROW(approximator.approximate({}, {}, settings, out), Error);
  }
}

}  // namespace
}  // namespace polyhull
