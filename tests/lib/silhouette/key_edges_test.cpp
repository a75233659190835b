// SPDX-License-Identifier: LGPL-2.1-or-later
// The matte's edges and their colours, where neither screen nor subject have one colour only.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "base/srgb.h"
#include "key_checks.h"
#include "silhouette/contour/contourer.h"

namespace polyhull {
namespace {

using test::Colour;
using test::mix;

constexpr Colour screen{60, 170, 75}, red{170, 35, 40}, brown{120, 85, 60}, white{235, 235, 235},
    black{22, 22, 22}, blue{50, 70, 160}, yellow{215, 190, 60};
constexpr int size = 128;  // of a disk's part of the picture

/// Disks side by side before a screen.
struct Stage {
  std::vector<Colour> disks;
  double uneven = 0.0;    // share of the screen's light that changes from left to right
  bool in_light = false;  // edges mix light
  double noise = 1.0;     // levels
  double sigma = 1.0;     // px, of the edges' smoothing

  double alpha(int x, int y) const {
    const double d = 41.3 - std::hypot(x % size - 63.7, y - 63.2);
    return disks.empty() ? 0.0 : 0.5 * std::erfc(-d / (sigma * std::numbers::sqrt2));
  }
  int width() const { return size * std::max(static_cast<int>(disks.size()), 1); }
  Colour colour(int x, int y, double t) const {
    const double light = 1.0 + uneven * (2.0 * x / width() - 1.0);
    const Colour from{screen[0] * light, screen[1] * light, screen[2] * light};
    if (disks.empty()) return from;
    const Colour to = disks[static_cast<std::size_t>(x / size)];
    if (!in_light) return mix(from, to, t);
    Colour out;
    for (std::size_t c = 0; c < 3; ++c)
      out[c] = 255.0 * srgb_encoded((1.0 - t) * srgb_decoded(from[c] / 255.0) +
                                    t * srgb_decoded(to[c] / 255.0));
    return out;
  }
  test::Frame frame(FrameFormat format, int pixels_across) const {
    std::mt19937 random(5);
    std::normal_distribution<double> grain(0.0, 1.0);
    return test::make_frame(format, pixels_across, size, [&](int x, int y) {
      Colour c = colour(x % width(), y, alpha(x, y));
      for (double& v : c) v += noise * grain(random);
      return c;
    });
  }
};

/// By how many px a matte's contour lies outside of that of the stage's true alpha, on average.
double bias(const Matte& matte, const Stage& stage) {
  const auto outline = [](const Matte& m) {
    ContourSettings settings;
    settings.approximate.tolerance = 0.0;
    Contourer contourer;
    const Rings& rings = contourer.find(m, settings);
    double area = 0.0, length = 0.0;
    for (std::size_t i = 0; i < rings.size(); ++i)
      for (std::size_t k = 0, n = rings.ring(i).size(); k < n; ++k) {
        const Vec2 a(rings.ring(i)[k]), b(rings.ring(i)[(k + 1) % n]);
        area += 0.5 * (a.x * b.y - a.y * b.x);
        length += glm::length(b - a);
      }
    return std::pair(std::abs(area), length);
  };
  const auto [area, unused] = outline(matte);
  const auto [truth, length] = outline(test::matte_of(matte.width, matte.height, [&](int x, int y) {
    return static_cast<int>(std::lround(255.0 * stage.alpha(x, y)));
  }));
  return (area - truth) / length;
}

double bias_of(const Stage& stage, FrameFormat format) {
  return bias(test::key({}, stage.frame(format, stage.width()).view), stage);
}

TEST(KeyEdges, EachColourOfTheSubjectHasItsContour) {
  for (const auto& colours : {std::vector{red, brown}, std::vector{blue, yellow}})
    for (const double uneven : {0.0, 0.15})
      for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::nv12, FrameFormat::v210})
        EXPECT_NEAR(bias_of({colours, uneven}, format), 0.0, 0.05)
            << name_of(format) << ", uneven by " << uneven;
}

TEST(KeyEdges, LightAndNumbersAreToldApart) {
  for (const Colour& colour : {white, black, red, yellow})
    for (const bool in_light : {false, true})
      EXPECT_NEAR(bias_of({{colour}, 0.0, in_light}, FrameFormat::rgbx), 0.0,
                  in_light ? 0.09 : 0.02)
          << colour[0] << " " << colour[1] << " " << colour[2] << (in_light ? " in light" : "");
}

TEST(KeyEdges, ASubjectThatComesLaterIsSampledThen) {
  for (const auto& colours : {std::vector{red, brown}, std::vector{white, black}}) {
    const Stage stage{colours};
    Keyer keyer;
    keyer.set({});
    Matte matte;
    keyer.key(Stage{}.frame(FrameFormat::nv12, stage.width()).view, matte);
    EXPECT_EQ(test::area_of(matte), 0.0);
    EXPECT_EQ(keyer.calibration().foreground, Rgb{});
    keyer.key(stage.frame(FrameFormat::nv12, stage.width()).view, matte);
    EXPECT_NEAR(bias(matte, stage), 0.0, 0.03);
    EXPECT_NE(keyer.calibration().foreground, Rgb{});
  }
}

// Where the matte is clearly above 0, colours are the subject's own, so that it can stand before
// anything; and where it is 0 but near, for mattes that are blurred afterwards.
TEST(KeyEdges, ColoursAreStraight) {
  for (const bool in_light : {false, true})
    for (const FrameFormat format : {FrameFormat::rgbx, FrameFormat::i420}) {
      const Stage stage{{white, black, red, blue}, 0.1, in_light, 1.0, 2.5};
      const test::Frame frame = stage.frame(format, stage.width());
      Keyer keyer;
      keyer.set({});
      Matte matte;
      keyer.key(frame.view, matte);
      std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * stage.width() * size));
      keyer.write_rgba(frame.view, matte, {0, 0, stage.width(), size}, KeyView::composite,
                       rgba.data(), 4 * stage.width());
      double worst[2] = {}, sum[2] = {}, count[2] = {};
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < stage.width(); ++x) {
          const double alpha = stage.alpha(x, y), found = matte.row(y)[x] / 255.0;
          const bool near = alpha > 1e-4 && alpha < 0.1;
          if (!near && alpha < 0.1) continue;
          const Colour truth = stage.disks[static_cast<std::size_t>(x / size)];
          for (std::size_t c = 0; c < 3; ++c) {
            // What a viewer sees of it is its share.
            const double error =
                std::abs(rgba[4 * static_cast<std::size_t>(y * stage.width() + x) + c] - truth[c]);
            const double seen = near ? error : error * found;
            worst[near] = std::max(worst[near], seen);
            sum[near] += seen, count[near] += 1.0;
          }
        }
      std::printf("%s%s: colours off by %.2f levels, %.1f at most; beside the matte %.2f, %.1f\n",
                  name_of(format), in_light ? " in light" : "", sum[0] / count[0], worst[0],
                  sum[1] / count[1], worst[1]);
      EXPECT_LT(sum[0] / count[0], 4.0);
      EXPECT_LT(sum[1] / count[1], 16.0);
    }
}

// A shadow on the screen is screen; smooth hair beside the subject is not.
TEST(KeyEdges, ShadowsAreScreenAndHairIsNot) {
  const auto alpha = [](int x) { return std::clamp((150.0 - x) / 40.0, 0.0, 1.0); };
  const auto frame = [&](bool hair) {
    return test::make_frame(FrameFormat::bgrx, 480, 160, [&](int x, int y) {
      const double soft = std::clamp((x - 330.0) / 40.0, 0.0, 1.0);
      const double light = 1.0 - 0.25 * soft;
      const Colour behind{screen[0] * light, screen[1] * light, screen[2] * light};
      return mix(behind, white, hair ? alpha(x) : x < 130 ? 1.0 : 0.0);
    });
  };
  const test::Frame straight = frame(false), soft = frame(true);
  const Matte matte = test::key({}, straight.view);
  for (int y = 0; y < 160; y += 7)
    for (int x = 136; x < 480; ++x) ASSERT_LE(matte.row(y)[x], 2) << x << "," << y;
  const Matte hair = test::key({}, soft.view);
  double worst = 0.0, sum = 0.0, count = 0.0;
  for (int y = 0; y < 160; y += 7)
    for (int x = 110; x < 150; ++x) {
      const double error = std::abs(hair.row(y)[x] / 255.0 - alpha(x));
      worst = std::max(worst, error);
      sum += error, count += 1.0;
    }
  std::printf("hair's alpha off by %.3f, %.3f at most\n", sum / count, worst);
  EXPECT_LT(worst, 0.16);
  EXPECT_LT(sum / count, 0.06);
}

TEST(KeyEdges, GivenColoursHoldEverywhere) {
  const Stage stage{{red, brown}};
  const test::Frame frame = stage.frame(FrameFormat::bgrx, stage.width());
  KeySettings settings;
  settings.screen = test::rgb(screen);
  settings.foreground = test::rgb(red);
  const Matte matte = test::key(settings, frame.view);
  // Red is what was said, brown is not: only red's contour is right.
  const auto area = [&](int from) {
    double sum = 0.0;
    for (int y = 0; y < size; ++y)
      for (int x = from; x < from + size; ++x) sum += matte.row(y)[x] / 255.0 - stage.alpha(x, y);
    return std::abs(sum) / (2.0 * std::numbers::pi * 41.3);
  };
  EXPECT_LT(area(0), 0.05);
  EXPECT_GT(area(size), 0.1);
}

// Of a screen of two hues in squares no square is like the rest.
TEST(KeyEdges, AScreenOfTwoHuesIsKeyedAllTheSame) {
  const test::Frame frame = test::make_frame(FrameFormat::rgbx, 320, 160, [](int x, int y) {
    if (x % 64 < 24) return red;
    return (x / 16 + y / 16) % 2 == 0 ? Colour{60, 200, 40} : Colour{40, 200, 60};
  });
  Keyer keyer;
  keyer.set({});
  Matte matte;
  for (int i = 0; i < 2; ++i) keyer.key(frame.view, matte);
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 320; ++x)
      if (x % 64 < 24)
        ASSERT_GT(matte.row(y)[x], 200) << x << "," << y;
      else
        ASSERT_LT(matte.row(y)[x], 60) << x << "," << y;
}

// A dull fold of an empty stage is no subject, before somebody comes and after.
TEST(KeyEdges, AFoldIsNotTakenForTheSubject) {
  const Stage stage{{red, brown}};
  const auto frame = [&](bool empty) {
    return test::make_frame(FrameFormat::bgrx, stage.width() + 128, size, [&](int x, int y) {
      if (x < stage.width()) return stage.colour(x, y, empty ? 0.0 : stage.alpha(x, y));
      return x > stage.width() + 40 && x < stage.width() + 80 ? Colour{22, 62, 27} : screen;
    });
  };
  Keyer keyer;
  keyer.set({});
  Matte matte;
  keyer.key(frame(true).view, matte);
  EXPECT_EQ(keyer.calibration().foreground, Rgb{});
  keyer.key(frame(false).view, matte);
  double sum = 0.0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < stage.width(); ++x) sum += matte.row(y)[x] / 255.0 - stage.alpha(x, y);
  EXPECT_NEAR(sum / (4.0 * std::numbers::pi * 41.3), 0.0, 0.03);
}

TEST(KeyEdges, TheSamePictureAgainIsKeyedTheSame) {
  for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::nv12}) {
    const Stage stage{{white, yellow}, 0.2, true, 4.0};
    const test::Frame frame = stage.frame(format, stage.width());
    Keyer keyer;
    keyer.set({});
    Matte first, again;
    keyer.key(frame.view, first);
    for (int i = 0; i < 3; ++i) keyer.key(frame.view, again);
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < stage.width(); ++x)
        ASSERT_EQ(first.row(y)[x], again.row(y)[x]) << name_of(format) << " " << x << "," << y;
  }
}

TEST(KeyEdges, ColoursAreStraightBeforeAPlate) {
  const Stage stage{{white, black}};
  const test::Frame frame = stage.frame(FrameFormat::rgbx, stage.width());
  auto plate = std::make_shared<Picture>(Picture{stage.width(), size, 3, {}});
  for (int i = 0; i < stage.width() * size; ++i)
    for (const double c : screen) plate->pixels.push_back(static_cast<std::uint8_t>(c));
  KeySettings settings;
  for (const bool with_plate : {false, true}) {
    if (with_plate) settings.plate = plate;
    Keyer keyer;
    keyer.set(settings);
    Matte matte;
    keyer.key(frame.view, matte);
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * stage.width() * size));
    keyer.write_rgba(frame.view, matte, {0, 0, stage.width(), size}, KeyView::composite,
                     rgba.data(), 4 * stage.width());
    double sum = 0.0, count = 0.0;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < stage.width(); ++x) {
        const double alpha = stage.alpha(x, y);
        if (alpha < 0.2 || alpha > 0.8) continue;
        const Colour truth = stage.disks[static_cast<std::size_t>(x / size)];
        for (std::size_t c = 0; c < 3; ++c)
          sum += std::abs(rgba[4 * static_cast<std::size_t>(y * stage.width() + x) + c] - truth[c]);
        count += 3.0;
      }
    EXPECT_LT(sum / count, with_plate ? 12.0 : 6.0);
  }
}

// A print whose colour is far from the screen's makes nothing beside it translucent, however little
// of the subject there is.
TEST(KeyEdges, StrongColoursBesideOthersLeaveThemSolid) {
  for (const Colour& print : {Colour{255, 0, 255}, Colour{200, 20, 30}})
    for (const int half : {7, 16}) {
      const auto distance = [](int x, int y) { return 22.3 - std::hypot(x - 63.7, y - 63.2); };
      const test::Frame frame = test::make_frame(FrameFormat::rgbx, size, size, [&](int x, int y) {
        const Colour inside =
            std::max(std::abs(x - 63), std::abs(y - 63)) < half ? print : Colour{200, 190, 180};
        return mix(screen, inside, std::clamp(distance(x, y) + 0.5, 0.0, 1.0));
      });
      const Matte matte = test::key({}, frame.view);
      double area = 0.0, truth = 0.0;
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          area += matte.row(y)[x] / 255.0;
          truth += std::clamp(distance(x, y) + 0.5, 0.0, 1.0);
          if (distance(x, y) <= 1.0) continue;
          ASSERT_EQ(matte.row(y)[x], 255) << x << "," << y << " " << half;
        }
      EXPECT_NEAR((area - truth) / (2.0 * std::numbers::pi * 22.3), 0.0, 0.2) << print[0] << half;
    }
}

// Mattes that are grown, or blurred afterwards, find the subject's colour beside it, not the screen's; so
// do those of a wire of two rows.
TEST(KeyEdges, TheSubjectsColourGoesOnBesideIt) {
  const Colour pale{200, 190, 180};
  const auto inside = [](int x, int y) {
    return (std::abs(x - 40) < 24 && std::abs(y - 64) < 30) ||
           (x > 60 && x < 110 && (y == 50 || y == 51));
  };
  const test::Frame frame = test::make_frame(
      FrameFormat::rgbx, size, size, [&](int x, int y) { return inside(x, y) ? pale : screen; });
  for (const double choke : {0.0, -8.0}) {
    KeySettings settings;
    settings.choke = choke;
    Keyer keyer;
    keyer.set(settings);
    Matte matte;
    keyer.key(frame.view, matte);
    std::vector<std::uint8_t> rgba(static_cast<std::size_t>(4 * size * size));
    keyer.write_rgba(frame.view, matte, {0, 0, size, size}, KeyView::composite, rgba.data(),
                     4 * size);
    int grown = 0;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < 80; ++x) {
        bool near = false;
        for (int dy = -4; dy <= 4; ++dy) near |= inside(x, y + dy);
        if (inside(x, y) || (matte.row(y)[x] < 250 && !near)) continue;
        ++grown;
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(rgba[4 * static_cast<std::size_t>(y * size + x) + c], pale[c], 40)
              << x << "," << y << " choke " << choke;
      }
    EXPECT_GT(grown, choke < 0.0 ? 1000 : 400);
  }
}

TEST(KeyEdges, BlackMayBeGivenAsForeground) {
  KeySettings settings;
  settings.foreground = Rgb{0, 0, 0};
  Keyer keyer;
  keyer.set(settings);
  Matte matte;
  keyer.key(Stage{{red, brown}}.frame(FrameFormat::bgrx, 2 * size).view, matte);
  EXPECT_EQ(keyer.calibration().foreground, (Rgb{0, 0, 0}));
}

}  // namespace
}  // namespace polyhull
