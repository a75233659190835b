// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/approximate.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "silhouette/blur/blur.h"
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

// Everything that is promised of a result by itself.
void expect_sound(const Rings& result) {
  EXPECT_TRUE(test::simple_and_disjoint(result));
  EXPECT_TRUE(test::well_nested(result));
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

// Twenty-four narrow teeth: their tips bend more sharply than any tolerance lets a corner follow.
Matte teeth(int size) {
  const auto radius = [](double angle) { return 322.0 + 120.0 * std::cos(24.0 * angle); };
  return test::draw(size, size, [&](int x, int y) {
    const double dx = x - size / 2 + 0.3, dy = y - size / 2 - 0.2;
    const double d = radius(std::atan2(dy, dx)) - std::hypot(dx, dy);
    if (std::abs(d) > 16.0) return d > 0 ? 255 : 0;
    return test::coverage(x, y, [&](double u, double v) {
      const double ex = u - size / 2 + 0.3, ey = v - size / 2 - 0.2;
      return std::hypot(ex, ey) < radius(std::atan2(ey, ex));
    });
  });
}

Matte ellipse(int width, int height, double a, double b) {
  return test::draw(width, height, [&](int x, int y) {
    return test::coverage(x, y, [&](double u, double v) {
      return std::hypot((u - width / 2) / a, (v - height / 2 + 0.3) / b) < 1.0;
    });
  });
}

TEST(Approximate, WithinToleranceAndWithoutBias) {
  struct Shape {
    const char* name;
    Matte matte;
    std::size_t most[4];  // vertices, at each tolerance
  };
  const Shape shapes[] = {{"star", star(760, 250.0), {110, 80, 60, 40}},
                          {"teeth", teeth(920), {340, 240, 190, 120}},
                          {"disk", test::soft_disk(440, 219.7, 220.4, 200.0), {48, 34, 24, 17}},
                          {"ellipse", ellipse(440, 280, 200.0, 120.0), {40, 30, 22, 16}}};
  std::printf("%-8s %9s %8s %9s %9s\n", "shape", "tolerance", "vertices", "hausdorff", "bias");
  for (const Shape& shape : shapes) {
    const Traced traced = trace(shape.matte, 2.0);
    ASSERT_EQ(traced.rings.size(), 1u);
    const double area = test::total_area(traced.rings), length = test::total_length(traced.rings);
    const std::size_t* most = shape.most;
    for (const double tolerance : {0.5, 1.0, 2.0, 4.0}) {
      ApproximateSettings settings;
      settings.tolerance = tolerance;
      const Rings result = approximate(traced, settings);
      ASSERT_EQ(result.size(), 1u);
      expect_sound(result);
      const double distance = std::max(test::one_sided_distance(traced.rings, result, 0.3),
                                       test::one_sided_distance(result, traced.rings, 0.3));
      const double bias = (test::total_area(result) - area) / length;
      std::printf("%-8s %9g %8zu %9.4f %+9.4f\n", shape.name, tolerance, result.points.size(),
                  distance, bias);
      EXPECT_LE(distance, tolerance) << shape.name;
      EXPECT_LE(std::abs(bias), 0.025) << shape.name << " " << tolerance;
      EXPECT_LE(result.points.size(), *most++) << shape.name << " " << tolerance;
    }
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
    expect_sound(result);
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
      expect_sound(result);
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
