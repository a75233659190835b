// SPDX-License-Identifier: LGPL-2.1-or-later
// Patterns and sizes that are hard on blur, tracer and approximation, each against a slow exact
// reference. POLYHULL_FULL_SIZE=1 adds a frame of 16384x16384.
#include <gtest/gtest.h>

#include <cstdlib>

#include "silhouette/silhouette.h"
#include "silhouette_checks.h"

namespace polyhull {
namespace {

struct Case {
  const char* name;
  int width, height;
  std::function<int(int, int)> level;
  int rings;  // without blur; -1: not known beforehand
};

std::vector<Case> cases() {
  auto random = std::make_shared<std::mt19937>(5);
  const auto spiral = [](int x, int y) {
    const double r = std::hypot(x - 60.2, y - 59.7), a = std::atan2(y - 59.7, x - 60.2);
    return r < 55 && std::fmod(r + 3.0 * (a / M_PI + 1.0), 6.0) < 3.0 ? 255 : 0;
  };
  return {
      {"one pixel", 1, 1, [](int, int) { return 255; }, 1},
      {"empty", 37, 19, [](int, int) { return 0; }, 0},
      {"full", 37, 19, [](int, int) { return 255; }, 1},
      {"checkerboard", 65, 33, [](int x, int y) { return (x + y) % 2 * 255; }, -1},
      {"single pixels", 90, 60, [](int x, int y) { return x % 9 == 4 && y % 6 == 2 ? 255 : 0; },
       100},
      {"noise at 50 %", 111, 73,
       [random](int, int) { return static_cast<int>((*random)() % 2) * 255; }, -1},
      {"comb of one-pixel lines", 127, 64, [](int x, int y) { return x % 2 * 255 * (y > 3); }, 63},
      {"comb with a spine", 127, 64, [](int x, int y) { return y < 4 || x % 2 ? 255 : 0; }, 1},
      {"rake", 64, 127, [](int, int y) { return y % 2 * 255; }, 63},
      {"spiral", 121, 120, spiral, -1},
      {"ten thousand components", 300, 300,
       [](int x, int y) { return x % 3 == 1 && y % 3 == 1 ? 255 : 0; }, 10000},
      {"ten thousand holes", 300, 300,
       [](int x, int y) { return x % 3 == 1 && y % 3 == 1 ? 0 : 255; }, 10001},
      {"corners that touch", 80, 60, [](int x, int y) { return (x / 5 + y / 5) % 2 * 255; }, -1},
      {"two squares at a corner", 20, 20,
       [](int x, int y) { return (x < 10) == (y < 10) ? 255 : 0; }, -1},
      {"the border", 50, 40,
       [](int x, int y) { return x == 0 || y == 0 || x == 49 || y == 39 ? 255 : 0; }, 2},
      {"one corner", 50, 40, [](int x, int y) { return x + y == 0 ? 255 : 0; }, 1},
      {"one row", 301, 1, [](int x, int) { return x / 7 % 2 * 255; }, 21},
      {"one column", 1, 301, [](int, int y) { return y / 7 % 2 * 255; }, 21},
  };
}

void expect_sound(const Field& field, const Rings& rings, const std::string& name) {
  EXPECT_EQ(test::meeting_edges(rings), "") << name;
  EXPECT_EQ(test::misplaced_pixel(rings, field), "") << name;
  EXPECT_LE(test::marching_area(field).excess(test::total_area(rings)),
            1e-6 + 3e-3 * static_cast<double>(rings.points.size()))
      << name;
}

TEST(SilhouetteStress, PatternsAgainstExactReferences) {
  for (const Case& c : cases())
    for (const double sigma : {0.0, 0.7, 2.0, 90.0}) {
      if (sigma > 50.0 && c.width > 100) continue;  // the reference is slow; smaller ones do
      const std::string name = std::string(c.name) + ", sigma " + std::to_string(sigma);
      const Matte matte = test::draw(c.width, c.height, c.level);
      const std::vector<double> want =
          sigma > 0.0 ? test::exact_blur(matte, sigma) : std::vector<double>();
      Field field;
      for (const BlurMethod method : {BlurMethod::recursive, BlurMethod::fir}) {
        Blur blur;
        blur.set({method, sigma, 3, 0});
        blur.apply(matte, field);
        double most = 0.0;
        for (int y = 0; y < c.height; ++y)
          for (int x = 0; x < c.width; ++x) {
            const double exact = sigma > 0.0 ? want[static_cast<std::size_t>(y) * c.width + x]
                                             : static_cast<double>(matte.row(y)[x]);
            most = std::max(most,
                            std::abs(field.row(y)[x] / static_cast<double>(field_scale) - exact));
          }
        EXPECT_LE(most, 0.5) << name << ", blur method " << static_cast<int>(method);
      }
      Tracer tracer;
      Rings traced, corrected;
      std::vector<std::int32_t> parents;
      tracer.trace(field, {TraceMethod::subpixel, sigma}, corrected);
      EXPECT_EQ(test::meeting_edges(corrected), "") << name << ", corrected";
      tracer.trace(field, {TraceMethod::subpixel, 0.0}, traced, &parents);
      expect_sound(field, traced, name);
      if (sigma == 0.0 && c.rings >= 0) {
        EXPECT_EQ(traced.size(), static_cast<std::size_t>(c.rings)) << name;
      }
      if (traced.size() < 2000) {
        EXPECT_EQ(test::nesting_fault(traced), "") << name;
      }
      for (const double tolerance : {0.4, 3.0}) {
        ApproximateSettings settings;
        settings.tolerance = tolerance;
        settings.min_area = 0.0;
        settings.min_edges = 3;
        Approximator approximator;
        Rings polygons;
        approximator.approximate(traced, parents, settings, polygons);
        EXPECT_EQ(polygons.size(), traced.size()) << name;
        EXPECT_EQ(test::meeting_edges(polygons), "") << name << ", tolerance " << tolerance;
        if (polygons.empty()) continue;
        EXPECT_LE(test::one_sided_distance(polygons, traced, 0.5), tolerance + 1e-6) << name;
        EXPECT_LE(test::one_sided_distance(traced, polygons, 0.5), tolerance + 1e-6) << name;
      }
    }
}

// A screen with squares of subject before it, as NV12: two bytes per four pixels tell the colour.
struct Squares {
  int width, height, period, side;
  std::vector<std::uint8_t> bytes;
  FrameView view;

  Squares(int w, int h, int period_, int side_)
      : width(w), height(h), period(period_), side(side_) {
    const std::size_t pixels = static_cast<std::size_t>(w) * h;
    bytes.assign(pixels + pixels / 2, 120);
    std::uint8_t* chroma = bytes.data() + pixels;
    for (int y = 0; y < h / 2; ++y)
      for (int x = 0; x < w / 2; ++x) {
        const bool in = 2 * x % period < side && 2 * y % period < side;
        chroma[static_cast<std::size_t>(y) * w + 2 * x] = in ? 128 : 80;
        chroma[static_cast<std::size_t>(y) * w + 2 * x + 1] = in ? 128 : 70;
      }
    view.format = FrameFormat::nv12;
    view.width = w;
    view.height = h;
    view.planes = {bytes.data(), chroma, nullptr};
    view.strides = {w, w, 0};
  }
};

// Each square by itself, of about the area it has, sound as a whole.
void expect_squares(const Squares& squares, bool all_pairs) {
  SilhouetteSettings settings;
  settings.keep_matte = false;
  settings.reuse = false;
  Silhouetter silhouetter;
  silhouetter.set(settings);
  const Rings& rings = silhouetter.process(squares.view);
  const int across = (squares.width + squares.period - 1) / squares.period;
  const int down = (squares.height + squares.period - 1) / squares.period;
  ASSERT_EQ(rings.size(), static_cast<std::size_t>(across) * down);
  if (all_pairs) {
    EXPECT_EQ(test::meeting_edges(rings), "");
  }
  const double side = squares.side;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    // Chroma lies between the pixels: squares reach half a pixel to a pixel beyond their own, and
    // the blur rounds their corners.
    ASSERT_NEAR(ring_area(rings.ring(i)), side * side, 4.0 * side) << i;
    for (const Vec2f p : rings.ring(i)) {
      ASSERT_TRUE(p.x >= -1.5f && p.x <= static_cast<float>(squares.width) + 0.5f);
      ASSERT_TRUE(p.y >= -1.5f && p.y <= static_cast<float>(squares.height) + 0.5f);
    }
  }
}

TEST(SilhouetteStress, LongestRowsAndColumns) {
  expect_squares({16384, 64, 64, 40}, true);
  expect_squares({64, 16384, 64, 40}, true);
}

TEST(SilhouetteStress, LargestFrame) {
  if (std::getenv("POLYHULL_FULL_SIZE") == nullptr)
    GTEST_SKIP() << "set POLYHULL_FULL_SIZE=1 for a frame of 16384x16384 (0.5 GiB)";
  expect_squares({16384, 16384, 256, 160}, false);
}

}  // namespace
}  // namespace polyhull
