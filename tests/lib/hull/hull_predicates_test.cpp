// SPDX-License-Identifier: LGPL-2.1-or-later
// Exact integers, the perturbed determinant and the cleaning of rings, against small slow
// references.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "hull/cones/clean_region.h"
#include "hull/exact/exact_integer.h"
#include "hull/exact/planes.h"

namespace polyhull::hull {
namespace {

std::int64_t random_below(std::mt19937_64& random, std::int64_t limit) {
  return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(2 * limit - 1)) -
         (limit - 1);
}

TEST(ExactInteger, AgreesWithBuiltInArithmetic) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const Int128 a = random_below(random, std::int64_t{1} << 60);
    const Int128 b = random_below(random, std::int64_t{1} << 60);
    const Int<4> product = multiply(Int<2>::from(a), Int<2>::from(b));
    const Int<4> expected = Int<4>::from(a * b);
    ASSERT_EQ(product.limb, expected.limb);
    Int<4> difference = product;
    difference -= Int<4>::from(b);
    ASSERT_EQ(difference.limb, Int<4>::from(a * b - b).limb);
    ASSERT_EQ(product.sign(), a * b > 0 ? 1 : a * b < 0 ? -1 : 0);
    ASSERT_DOUBLE_EQ(product.to_double(), static_cast<double>(a * b));
  }
}

TEST(ExactInteger, HoldsTheLargestDeterminant) {
  // The bounds that exact_integer.h promises: no product of two such minors may overflow.
  const Int128 n = (Int128{1} << 80) - 1, o = (Int128{1} << 126) - 1;
  const Int<4> small = minor(n, -n, n, n), large = minor(n, -o, n, o);
  EXPECT_EQ(small.sign(), 1);
  EXPECT_EQ(large.sign(), 1);
  Int<8> sum = multiply(small, large);
  for (int k = 0; k < 5; ++k) sum += multiply(small, large);
  EXPECT_EQ(sum.sign(), 1);
  EXPECT_NEAR(sum.to_double(-256), 6 * 4 * std::ldexp(1.0, 3 * 80 + 126 - 256),
              1e-6 * sum.to_double(-256));
}

Plane random_plane(std::mt19937_64& random, std::int64_t limit) {
  return {random_below(random, limit), random_below(random, limit), random_below(random, limit),
          random_below(random, limit)};
}

/// Laplace's expansion in built-in integers, for entries below 2^25.
Int128 slow_determinant(std::array<Plane, 4> p) {
  const auto at = [&](int row, int column) {
    return column == 0 ? p[row].a : column == 1 ? p[row].b : column == 2 ? p[row].c : p[row].o;
  };
  Int128 sum = 0;
  std::array<int, 4> column{0, 1, 2, 3};
  do {
    int inversions = 0;
    for (int i = 0; i < 4; ++i)
      for (int k = i + 1; k < 4; ++k) inversions += column[i] > column[k];
    const Int128 term = at(0, column[0]) * at(1, column[1]) * at(2, column[2]) * at(3, column[3]);
    sum += inversions % 2 == 0 ? term : -term;
  } while (std::next_permutation(column.begin(), column.end()));
  return sum;
}

TEST(Determinant, AgreesWithTheExpansion) {
  std::mt19937_64 random(2);
  int zeros = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::int64_t limit = i % 2 == 0 ? 3 : 1 << 25;  // small entries give many zeros
    std::array<Plane, 4> p;
    for (Plane& plane : p) plane = random_plane(random, limit);
    const Int128 slow = slow_determinant(p);
    zeros += slow == 0;
    ASSERT_EQ(determinant_sign(p[0], p[1], p[2], p[3]), slow > 0 ? 1 : slow < 0 ? -1 : 0);
  }
  EXPECT_GT(zeros, 100);
}

PlaneSet random_set(std::mt19937_64& random, std::int64_t limit) {
  PlaneSet set;
  for (int k = 0; k < 4; ++k) {
    set.planes.push_back(random_plane(random, limit));
    set.group.push_back(k);
    set.perturbation.push_back(random_plane(random, 1 << 10));
  }
  return set;
}

TEST(Orientation, IsTheSignForSmallRealPerturbations) {
  // e_k = 2^-(12 * 2^k): the size of a subset's term is 2^-12 to the subset's number, and terms are
  // below 24 * 2^4 < 2^9, so each outweighs all later ones. Each row is scaled by 1/e_k to
  // integers.
  std::mt19937_64 random(3);
  int degenerate = 0;
  for (int i = 0; i < 5000; ++i) {
    PlaneSet set;
    for (int k = 0; k < 4; ++k) {
      set.planes.push_back(random_plane(random, 2));
      set.group.push_back(k);
      set.perturbation.push_back(random_plane(random, 3));
    }
    degenerate += determinant_sign(set.planes[0], set.planes[1], set.planes[2], set.planes[3]) == 0;
    std::array<Plane, 4> p;
    for (int k = 0; k < 4; ++k) {
      const int shift = 12 << k;
      const Plane &a = set.planes[k], &q = set.perturbation[k];
      const Int128 s = Int128{1} << shift;
      p[k] = {a.a * s + q.a, a.b * s + q.b, a.c * s + q.c, a.o * s + q.o};
    }
    ASSERT_EQ(set.orientation(0, 1, 2, 3), determinant_sign(p[0], p[1], p[2], p[3]));
  }
  EXPECT_GT(degenerate, 500);
}

TEST(Orientation, ChangesSignWithEachSwap) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 5000; ++i) {
    const PlaneSet set = random_set(random, i % 2 == 0 ? 2 : std::int64_t{1} << 40);
    const int sign = set.orientation(0, 1, 2, 3);
    ASSERT_NE(sign, 0);
    ASSERT_EQ(set.orientation(1, 0, 2, 3), -sign);
    ASSERT_EQ(set.orientation(0, 3, 2, 1), -sign);
    ASSERT_EQ(set.orientation(3, 0, 1, 2), -sign);
    ASSERT_EQ(set.orientation(1, 2, 0, 3), sign);
  }
}

TEST(Point, LiesOnItsPlanes) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 5000; ++i) {
    const PlaneSet set = random_set(random, 1 << 20);
    const Vec3 x = set.point(2, 0, 1);
    for (int k = 0; k < 3; ++k) {
      const Plane& p = set.planes[k];
      const double a = static_cast<double>(p.a), b = static_cast<double>(p.b),
                   c = static_cast<double>(p.c), o = static_cast<double>(p.o);
      ASSERT_LE(std::abs(a * x.x + b * x.y + c * x.z + o),
                1e-13 * (std::abs(a * x.x) + std::abs(b * x.y) + std::abs(c * x.z) + std::abs(o)));
    }
  }
}

Contours ring(std::initializer_list<Vec2> points) {
  Contours c;
  for (const Vec2& p : points) {
    c.source.push_back(static_cast<std::uint32_t>(c.points.size()));
    c.points.push_back(p);
    c.view.push_back(0);
  }
  c.ends.push_back(static_cast<std::uint32_t>(c.points.size()));
  return c;
}

double area(const Contours& c) {
  double sum = 0.0;
  std::uint32_t begin = 0;
  for (std::uint32_t end : c.ends) {
    for (std::uint32_t i = begin; i < end; ++i) {
      const Vec2 &p = c.points[i], &q = c.points[i + 1 < end ? i + 1 : begin];
      sum += 0.5 * (p.x * q.y - p.y * q.x);
    }
    begin = end;
  }
  return sum;
}

TEST(CleanRegion, FollowsTheEvenOddRule) {
  const Contours bow = ring({{0, 0}, {8, 8}, {8, 0}, {0, 8}});
  Contours clean = clean_region({&bow, 1}, false);
  EXPECT_EQ(clean.ends.size(), 2u);  // two triangles that touch
  EXPECT_DOUBLE_EQ(area(clean), 32.0);

  const Contours twice = ring({{0, 0}, {8, 0}, {8, 8}, {0, 8}, {0, 0}, {8, 0}, {8, 8}, {0, 8}});
  EXPECT_TRUE(clean_region({&twice, 1}, false).ends.empty());

  const Contours spike = ring({{0, 0}, {8, 0}, {8, 4}, {20, 4}, {8, 4}, {8, 8}, {0, 8}});
  EXPECT_DOUBLE_EQ(area(clean_region({&spike, 1}, false)), 64.0);

  // The complement's rings enclose the solid from outside.
  const Contours square = ring({{0, 0}, {8, 0}, {8, 8}, {0, 8}});
  EXPECT_DOUBLE_EQ(area(clean_region({&square, 1}, true)), -64.0);
}

TEST(CleanRegion, IntersectsLayers) {
  const std::array<Contours, 2> layers{ring({{0, 0}, {8, 0}, {8, 8}, {0, 8}}),
                                       ring({{4, 4}, {12, 4}, {12, 12}, {4, 12}})};
  EXPECT_DOUBLE_EQ(area(clean_region(layers, false)), 16.0);
  // What neither holds: all but their union.
  EXPECT_DOUBLE_EQ(area(clean_region(layers, true)), -112.0);
}

TEST(CleanRegion, IsStableOnItsOwnResult) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> pixel(0.0, 400.0);
  for (int i = 0; i < 100; ++i) {
    Contours c;
    for (std::uint32_t k = 0; k < 12; ++k) {
      c.points.push_back({pixel(random), pixel(random)});
      c.source.push_back(k);
      c.view.push_back(0);
    }
    c.ends = {12};
    const Contours once = clean_region({&c, 1}, false);
    const Contours again = clean_region({&once, 1}, false);
    EXPECT_GT(area(once), 0.0);
    EXPECT_NEAR(area(again), area(once), 1e-9 * area(once));
    EXPECT_EQ(again.points.size(), once.points.size());
  }
}

}  // namespace
}  // namespace polyhull::hull
