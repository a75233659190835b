// SPDX-License-Identifier: LGPL-2.1-or-later
// Contours that stay where nothing moves.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "silhouette/blur/blur.h"
#include "silhouette/contour/contourer.h"
#include "silhouette_checks.h"

namespace polyhull {
namespace {

constexpr int width = 160, height = 120;
constexpr double tolerance = 0.7;

/// A body with an arm, with a rounded armpit: distance outside it, px.
double distance(double x, double y, double dx, double arm) {
  const double body = std::hypot((x - 60.0 - dx) / 1.0, (y - 64.0) / 1.3) - 30.0;
  const double t = std::clamp((x - 85.0 - dx) / 50.0, 0.0, 1.0);
  const double stick = std::hypot(x - (85.0 + dx + 50.0 * t), y - (60.4 - arm * t)) - 6.0;
  return -2.0 * std::log(std::exp(-0.5 * body) + std::exp(-0.5 * stick));
}

Field blurred(const std::vector<std::uint8_t>& alpha) {
  Matte matte;
  load_matte(alpha.data(), width, 1, width, height, matte);
  Blur blur;
  BlurSettings soft;
  soft.sigma = 1.5;
  blur.set(soft);
  Field out;
  blur.apply(matte, out);
  return out;
}

/// Its matte with \p noise (8-bit levels) where it is soft, blurred by sigma 1.5.
Field field(double dx, double arm, double noise, unsigned seed) {
  std::vector<std::uint8_t> alpha(static_cast<std::size_t>(width) * height);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double cover = std::clamp(0.5 - distance(x, y, dx, arm), 0.0, 1.0);
      const bool soft = cover > 0.0 && cover < 1.0;
      const double level = 255.0 * cover + (soft ? noise * normal(random) : 0.0);
      alpha[y * width + x] = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  }
  return blurred(alpha);
}

ContourSettings settings(double steadiness) {
  return {{}, {tolerance}, steadiness};
}

double to_line(Vec2f p, const Rings& rings) {
  double least = 1e9;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const auto ring = rings.ring(i);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2f a = ring[k], along = ring[(k + 1) % ring.size()] - a;
      const float square = glm::dot(along, along);
      const float t =
          square > 0.0f ? std::clamp(glm::dot(p - a, along) / square, 0.0f, 1.0f) : 0.0f;
      least = std::min(least, static_cast<double>(glm::distance(p, a + t * along)));
    }
  }
  return least;
}

/// The farthest that a corner of one is from the other's line.
double apart(const Rings& a, const Rings& b) {
  double most = 0.0;
  for (const Vec2f p : a.points) most = std::max(most, to_line(p, b));
  for (const Vec2f p : b.points) most = std::max(most, to_line(p, a));
  return most;
}

Rings traced(const Field& of) {
  Tracer tracer;
  Rings out;
  tracer.trace(of, {}, out);
  return out;
}

TEST(Steadiness, NoiseChangesNoByte) {
  Contourer steady, loose;
  const Rings first = steady.find(field(0, 0, 6.0, 0), settings(0.25));
  const Rings loose_first = loose.find(field(0, 0, 6.0, 0), settings(0.0));
  EXPECT_EQ(first, loose_first);
  EXPECT_FALSE(steady.stayed());
  int changed = 0;
  for (unsigned n = 1; n < 30; ++n) {
    const Field now = field(0, 0, 6.0, n);
    EXPECT_TRUE(steady.find(now, settings(0.25)) == first) << n;
    EXPECT_TRUE(steady.stayed()) << n;
    changed += loose.find(now, settings(0.0)) != loose_first;
    EXPECT_FALSE(loose.stayed());
  }
  EXPECT_EQ(changed, 29);
}

TEST(Steadiness, WhatMovesDoesNotLag) {
  Contourer steady, loose;
  for (unsigned n = 0; n < 12; ++n) {
    const Field now = field(1.7 * n, 0, 6.0, n);
    EXPECT_TRUE(steady.find(now, settings(0.25)) == loose.find(now, settings(0.0))) << n;
  }
}

TEST(Steadiness, ADriftIsFollowed) {
  Contourer steady;
  double most = 0.0, bias = 0.0;
  std::size_t corners = 0, fresh_corners = 0;
  Contourer loose;
  for (unsigned n = 0; n < 120; ++n) {
    const Field now = field(0.02 * n, 0, 6.0, n);
    const Rings line = traced(now);
    const Rings& kept = steady.find(now, settings(0.25));
    most = std::max(most, apart(kept, line));
    double left = 1e9, true_left = 1e9;
    for (const Vec2f p : kept.points) left = std::min<double>(left, p.x);
    for (const Vec2f p : line.points) true_left = std::min<double>(true_left, p.x);
    bias = std::max(bias, std::abs(left - true_left));
    corners += kept.points.size();
    fresh_corners += loose.find(now, settings(0.0)).points.size();
  }
  std::printf("drift: at most %.3f px off, corners %zu of %zu\n", most, corners, fresh_corners);
  EXPECT_LE(most, tolerance + 0.25);
  EXPECT_LE(bias, tolerance + 0.25);
  EXPECT_LE(corners, fresh_corners * 5 / 4);
}

TEST(Steadiness, OnlyWhatMovesIsMadeAnew) {
  Contourer steady;
  const Rings first = steady.find(field(0, 0, 6.0, 0), settings(0.25));
  for (unsigned n = 1; n < 10; ++n) {
    const Field now = field(0, 2.0 * n, 6.0, n);
    const Rings& kept = steady.find(now, settings(0.25));
    EXPECT_FALSE(steady.stayed());
    EXPECT_LE(apart(kept, traced(now)), tolerance + 0.25) << n;
    for (const Vec2f p : first.points) {
      if (p.x > 70.0f) continue;
      EXPECT_TRUE(std::find(kept.points.begin(), kept.points.end(), p) != kept.points.end())
          << n << ": " << p.x << " " << p.y;
    }
  }
}

TEST(Steadiness, OtherSettingsMakeAllAnew) {
  Contourer steady, fresh;
  steady.find(field(0, 0, 6.0, 0), settings(0.25));
  ContourSettings other = settings(0.25);
  other.approximate.tolerance = 0.3;
  const Field now = field(0, 0, 6.0, 1);
  EXPECT_EQ(steady.find(now, other), fresh.find(now, other));
  EXPECT_FALSE(steady.stayed());
}

TEST(Steadiness, TheTracedLineItselfIsAlwaysNew) {
  Contourer steady;
  ContourSettings exact = settings(0.25);
  exact.approximate.tolerance = 0.0;
  for (unsigned n = 0; n < 5; ++n) {
    const Field now = field(0, 0, 6.0, n);
    Contourer fresh;
    EXPECT_TRUE(steady.find(now, exact) == fresh.find(now, exact)) << n;
  }
}

// Whatever comes and goes, no two edges meet: old pieces and new ones beside each other, thin gaps,
// rings that part and join.
TEST(Steadiness, RingsStaySimpleAndApart) {
  std::mt19937 random(7);
  for (const double steadiness : {0.25, 1.0, 3.0}) {
    for (const double coarse : {0.0, 0.2, 0.7, 3.0}) {
      Contourer steady;
      ContourSettings s = settings(steadiness);
      s.approximate.tolerance = coarse;
      s.approximate.min_area = 0.0;
      std::vector<std::uint8_t> alpha(static_cast<std::size_t>(width) * height);
      std::generate(alpha.begin(), alpha.end(),
                    [&] { return static_cast<std::uint8_t>(random() % 256); });
      Rings last;
      std::size_t stayed = 0, all = 0;
      for (int n = 0; n < 40; ++n) {
        // A part of a cloud of blots changes a little, another altogether.
        for (std::size_t i = 0; i < alpha.size(); ++i) {
          const int change = random() % 8 == 0 && i % width < width / 2
                                 ? static_cast<int>(random() % 256)
                                 : static_cast<int>(random() % 17) - 8 + alpha[i];
          alpha[i] = static_cast<std::uint8_t>(std::clamp(change, 0, 255));
        }
        const Rings& rings = steady.find(blurred(alpha), s);
        ASSERT_TRUE(test::simple_and_disjoint(rings)) << steadiness << " " << coarse << " " << n;
        ASSERT_EQ(test::nesting_fault(rings), "") << steadiness << " " << coarse << " " << n;
        for (const Vec2f p : last.points)
          stayed += std::find(rings.points.begin(), rings.points.end(), p) != rings.points.end();
        all += last.points.size();
        last = rings;
      }
      if (coarse > 0.0) {
        EXPECT_GT(stayed, all / 10) << steadiness << " " << coarse;
      }
    }
  }
}

TEST(Steadiness, WhatLeavesIsGone) {
  Contourer steady;
  EXPECT_FALSE(steady.find(field(0, 0, 6.0, 0), settings(0.25)).empty());
  Field empty;
  empty.resize(width, height);
  std::fill(empty.values.begin(), empty.values.end(), std::int16_t{0});
  EXPECT_TRUE(steady.find(empty, settings(0.25)).empty());
  EXPECT_FALSE(steady.find(field(0, 0, 6.0, 0), settings(0.25)).empty());
}

TEST(Steadiness, RefusesWhatIsNone) {
  Contourer contourer;
  for (const double wrong : {-0.1, 11.0, std::nan("")})
    EXPECT_THROW(contourer.find(field(0, 0, 0.0, 0), settings(wrong)), Error) << wrong;
}

}  // namespace
}  // namespace polyhull
