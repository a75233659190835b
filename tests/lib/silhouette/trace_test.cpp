// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/contour/trace.h"

#include <gtest/gtest.h>

#include "silhouette/blur/blur.h"
#include "silhouette_checks.h"

namespace polyhull {
namespace {

Rings traced(const Matte& matte, double sigma, double corrected,
             TraceMethod method = TraceMethod::subpixel,
             std::vector<std::int32_t>* parents = nullptr) {
  Blur blur;
  BlurSettings settings;
  settings.sigma = sigma;
  blur.set(settings);
  Field field;
  blur.apply(matte, field);
  Tracer tracer;
  Rings rings;
  tracer.trace(field, {method, corrected}, rings, parents);
  return rings;
}

// Mean of |distance| and of the signed distance (outwards positive) to a circle, over the traced
// line.
struct Error {
  double absolute = 0.0, bias = 0.0;
};
Error circle_error(const Rings& rings, double cx, double cy, double radius) {
  Error error;
  double length = 0.0;
  for (const auto& s : test::segments_of(rings)) {
    const double w = std::hypot(s.b.x - s.a.x, s.b.y - s.a.y);
    // Simpson's rule along the segment.
    for (const auto& [t, part] :
         {std::pair{0.0, 1.0 / 6}, std::pair{0.5, 4.0 / 6}, std::pair{1.0, 1.0 / 6}}) {
      const double d =
          std::hypot(s.a.x + t * (s.b.x - s.a.x) - cx, s.a.y + t * (s.b.y - s.a.y) - cy) - radius;
      error.absolute += w * part * std::abs(d);
      error.bias += w * part * d;
    }
    length += w;
  }
  error.absolute /= length;
  error.bias /= length;
  return error;
}

TEST(Trace, DiskHasNoBias) {
  for (const double radius : {10.0, 20.0, 50.0, 100.0, 300.0}) {
    Error mean, plain;
    int n = 0;
    for (const double offset : {0.0, 0.27, 0.5}) {
      const int size = static_cast<int>(2 * radius) + 40;
      const double c = size / 2 + offset;
      const Matte disk = test::soft_disk(size, c, c - 0.13, radius);
      const Error e = circle_error(traced(disk, 2.0, 2.0), c, c - 0.13, radius);
      const Error p = circle_error(traced(disk, 2.0, 0.0), c, c - 0.13, radius);
      mean.absolute += e.absolute, mean.bias += e.bias, plain.bias += p.bias, ++n;
    }
    mean.absolute /= n, mean.bias /= n, plain.bias /= n;
    std::printf("disk R=%-4g mean abs %.4f bias %+.4f px (uncorrected bias %+.4f)\n", radius,
                mean.absolute, mean.bias, plain.bias);
    EXPECT_LE(mean.absolute, 0.02) << radius;
    if (radius >= 20.0) {
      EXPECT_LE(std::abs(mean.bias), 0.005) << radius;
    }
    EXPECT_NEAR(plain.bias, -2.0 / radius, 0.4 / radius) << "the blur's shift is sigma² / 2R";
  }
}

TEST(Trace, OrientationAndNesting) {
  // A ring with an island in its hole.
  const Matte matte = test::draw(64, 64, [](int x, int y) {
    const double d = std::hypot(x - 31.5, y - 31.5);
    return d < 5 || (d > 12 && d < 24) ? 255 : 0;
  });
  std::vector<std::int32_t> parents;
  const Rings rings = traced(matte, 1.0, 0.0, TraceMethod::subpixel, &parents);
  ASSERT_EQ(rings.size(), 3u);
  EXPECT_GT(ring_area(rings.ring(0)), 0.0);
  EXPECT_LT(ring_area(rings.ring(1)), 0.0);
  EXPECT_GT(ring_area(rings.ring(2)), 0.0);
  EXPECT_EQ(parents, (std::vector<std::int32_t>{-1, 0, 1}));
  EXPECT_TRUE(test::well_nested(rings));
  // Counter-clockwise on screen: on the outer ring's topmost edge the way leads to the left.
  const auto outer = rings.ring(0);
  std::size_t highest = 0;
  for (std::size_t i = 0; i < outer.size(); ++i)
    if (outer[i].y < outer[highest].y) highest = i;
  EXPECT_LT(outer[(highest + 1) % outer.size()].x,
            outer[(highest + outer.size() - 1) % outer.size()].x);
}

TEST(Trace, FrameBorderIsTheFramesEnd) {
  const Matte full = test::draw(37, 21, [](int, int) { return 255; });
  for (const TraceMethod method : {TraceMethod::subpixel, TraceMethod::binary}) {
    const Rings rings = traced(full, 2.0, 2.0, method);
    ASSERT_EQ(rings.size(), 1u);
    EXPECT_DOUBLE_EQ(ring_area(rings.ring(0)), 37.0 * 21.0);
    for (const Vec2f p : rings.ring(0))
      EXPECT_TRUE(p.x == -0.5f || p.x == 36.5f || p.y == -0.5f || p.y == 20.5f);
  }
  // A bar across the frame keeps its width up to the border.
  const Matte bar = test::draw(40, 40, [](int x, int) { return x >= 10 && x < 30 ? 255 : 0; });
  EXPECT_NEAR(test::total_area(traced(bar, 2.0, 2.0)), 20.0 * 40.0, 0.5);
}

// The area inside marching squares' segments, cell by cell, from the masks alone: for a binary
// matte without blur each cell of four centres contributes 0, 1/8, 1/2, 7/8 or 1, a joined or
// separate saddle 3/4 or 1/4, and the half cells at the frame's border their bars.
double marching_area(const Matte& m) {
  const auto in = [&](int x, int y) {
    return m.row(std::clamp(y, 0, m.height - 1))[std::clamp(x, 0, m.width - 1)] != 0;
  };
  double area = 0.0;
  for (int y = -1; y < m.height; ++y)
    for (int x = -1; x < m.width; ++x) {
      const int n = in(x, y) + in(x + 1, y) + in(x, y + 1) + in(x + 1, y + 1);
      const bool side_x = x == -1 || x == m.width - 1, side_y = y == -1 || y == m.height - 1;
      double part = n == 0 ? 0.0 : n == 4 ? 1.0 : n == 1 ? 0.125 : n == 3 ? 0.875 : 0.5;
      if (n == 2 && in(x, y) == in(x + 1, y + 1)) part = 0.75;  // mean is at the level: joined
      area += part * (side_x ? 0.5 : 1.0) * (side_y ? 0.5 : 1.0);
    }
  return area;
}

TEST(Trace, RandomMasks) {
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    const int width = 1 + static_cast<int>(random() % 70),
              height = 1 + static_cast<int>(random() % 40);
    const unsigned density = 1 + random() % 9;
    const Matte mask =
        test::draw(width, height, [&](int, int) { return random() % 10 < density ? 255 : 0; });
    double pixels = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) pixels += mask.row(y)[x] != 0;

    std::vector<std::int32_t> parents;
    const Rings soft = traced(mask, 0.0, 0.0, TraceMethod::subpixel, &parents);
    EXPECT_TRUE(test::simple_and_disjoint(soft));
    EXPECT_TRUE(test::well_nested(soft));
    // The level lies half a unit of 32640 below a saddle's mean, and vertices on a grid of 1/512
    // px.
    EXPECT_NEAR(test::total_area(soft), marching_area(mask),
                1e-3 * (1.0 + static_cast<double>(soft.points.size())));

    const Rings sharp = traced(mask, 0.0, 0.0, TraceMethod::binary);
    EXPECT_TRUE(test::simple_and_disjoint(sharp));
    EXPECT_TRUE(test::well_nested(sharp));
    // Exact but for the corners where two pixels touch.
    EXPECT_NEAR(test::total_area(sharp), pixels, 0.26 * width * height);
    const Rings blurred = traced(mask, 1.3, 1.3);
    EXPECT_TRUE(test::simple_and_disjoint(blurred));
    EXPECT_TRUE(test::well_nested(blurred));

    // Parents: the smallest ring around.
    for (std::size_t i = 0; i < soft.size(); ++i) {
      std::int32_t best = -1;
      for (std::size_t j = 0; j < soft.size(); ++j)
        if (i != j && test::contains(soft.ring(j), soft.ring(i)[0].x, soft.ring(i)[0].y) &&
            (best < 0 || std::abs(ring_area(soft.ring(j))) < std::abs(ring_area(soft.ring(best)))))
          best = static_cast<std::int32_t>(j);
      EXPECT_EQ(parents[i], best);
    }
    if (::testing::Test::HasFailure()) {
      std::printf("round %d: %d x %d, density %u\n", round, width, height, density);
      return;
    }
  }
}

TEST(Trace, EveryPixelOnItsSide) {
  // Each pixel centre lies inside exactly when its field is at or above the half level.
  std::mt19937 random(3);
  const Matte mask = test::draw(97, 61, [&](int x, int y) {
    return (x / 5 + y / 7) % 2 == 0 || random() % 5 == 0 ? static_cast<int>(random() % 256) : 0;
  });
  Blur blur;
  BlurSettings settings;
  settings.sigma = 0.8;
  blur.set(settings);
  Field field;
  blur.apply(mask, field);
  Tracer tracer;
  Rings rings;
  tracer.trace(field, {}, rings);
  for (int y = 0; y < 61; ++y)
    for (int x = 0; x < 97; ++x) {
      bool inside = false;
      for (std::size_t r = 0; r < rings.size(); ++r)
        if (test::contains(rings.ring(r), x, y)) inside = !inside;
      ASSERT_EQ(inside, field.row(y)[x] >= field_half) << x << ", " << y;
    }
}

TEST(Trace, EmptyAndSinglePixels) {
  EXPECT_TRUE(traced(test::draw(5, 4, [](int, int) { return 0; }), 2.0, 2.0).empty());
  EXPECT_EQ(traced(test::draw(1, 1, [](int, int) { return 255; }), 2.0, 2.0).size(), 1u);
  const Rings one =
      traced(test::draw(9, 9, [](int x, int y) { return x == 4 && y == 4 ? 255 : 0; }), 0.0, 0.0,
             TraceMethod::binary);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_DOUBLE_EQ(ring_area(one.ring(0)), 1.0);
}

TEST(Trace, CheckerboardKeepsRingsApart) {
  const Matte board = test::draw(40, 30, [](int x, int y) { return (x + y) % 2 ? 255 : 0; });
  for (const TraceMethod method : {TraceMethod::subpixel, TraceMethod::binary}) {
    const Rings rings = traced(board, 0.0, 0.0, method);
    EXPECT_TRUE(test::simple_and_disjoint(rings));
    EXPECT_TRUE(test::well_nested(rings));
  }
}

}  // namespace
}  // namespace polyhull
