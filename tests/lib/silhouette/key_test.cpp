// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/key/key.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "key_checks.h"
#include "silhouette/silhouette.h"

namespace polyhull {
namespace {

using test::area_of;
using test::Colour;
using test::disk_scene;
using test::key;
using test::mix;
using test::rgb;
using test::screen_green;
using test::skin;

TEST(Key, PrototypeRule) {
  std::mt19937 random(1);
  std::vector<Rgb> pixels(97 * 13);
  for (Rgb& p : pixels)
    for (auto& c : p) c = static_cast<std::uint8_t>(random());
  const auto colour = [&](int x, int y) {
    const Rgb& p = pixels[static_cast<std::size_t>(y) * 97 + x];
    return Colour{double(p[0]), double(p[1]), double(p[2])};
  };
  for (const KeyColour hue : {KeyColour::green, KeyColour::blue})
    for (const FrameFormat format :
         {FrameFormat::rgbx, FrameFormat::bgrx, FrameFormat::rgb, FrameFormat::bgra}) {
      KeySettings settings;
      settings.method = KeyMethod::threshold;
      settings.key = hue;
      settings.strength = 25;
      settings.bright_threshold = 600;
      const test::Frame frame = test::make_frame(format, 97, 13, colour);
      const Matte m = key(settings, frame.view);
      for (int y = 0; y < 13; ++y)
        for (int x = 0; x < 97; ++x) {
          const Rgb& p = pixels[static_cast<std::size_t>(y) * 97 + x];
          const int k = hue == KeyColour::green ? p[1] : p[2],
                    other = hue == KeyColour::green ? p[2] : p[1];
          const bool background = k - std::max<int>(p[0], other) > 25 && p[0] + p[1] + p[2] <= 600;
          ASSERT_EQ(m.row(y)[x], background ? 0 : 255) << name_of(format) << " " << x << "," << y;
        }
    }
}

TEST(Key, GainsChangeTheDecisionOnly) {
  // A greenish grey that a red gain of 1.5 makes foreground.
  const auto colour = [](int, int) { return Colour{100, 140, 90}; };
  const test::Frame frame = test::make_frame(FrameFormat::rgbx, 40, 4, colour);
  KeySettings settings;
  settings.method = KeyMethod::threshold;
  EXPECT_EQ(key(settings, frame.view).row(1)[5], 0);
  settings.red_gain = 1.5;
  settings.spill = 0.0;
  Keyer keyer;
  keyer.set(settings);
  Matte m;
  keyer.key(frame.view, m);
  EXPECT_EQ(m.row(1)[5], 255);
  std::vector<std::uint8_t> out(40 * 4 * 4);
  keyer.write_rgba(frame.view, m, {0, 0, 40, 4}, KeyView::composite, out.data(), 160);
  EXPECT_EQ(out[0], 100);
  EXPECT_EQ(out[1], 140);
  EXPECT_EQ(out[2], 90);
}

TEST(Key, DifferenceIgnoresShadows) {
  const auto room = [](int x, int y) { return Colour{120.0 + x % 40, 150.0 + y % 30, 140.0}; };
  auto plate = std::make_shared<Picture>(Picture{160, 100, 3, {}});
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 160; ++x)
      for (const double c : room(x, y)) plate->pixels.push_back(static_cast<std::uint8_t>(c));
  const auto scene = [&](int x, int y) {
    Colour c = room(x, y);
    if (x > 100 && y > 60)
      for (double& v : c) v *= 0.7;  // a soft shadow
    if (std::hypot(x - 50, y - 50) < 20) return Colour{60, 50, 130};
    return c;
  };
  const test::Frame frame = test::make_frame(FrameFormat::rgbx, 160, 100, scene);
  KeySettings settings;
  settings.method = KeyMethod::difference;
  settings.plate = plate;
  const Matte m = key(settings, frame.view);
  EXPECT_EQ(m.row(50)[50], 255);
  EXPECT_EQ(m.row(80)[130], 0) << "shadow";
  EXPECT_NEAR(area_of(m), M_PI * 400.0, 30.0);
  settings.shadow_darkest = 1.0;
  EXPECT_GT(area_of(key(settings, frame.view)), M_PI * 400.0 + 1000.0)
      << "without tolerance the shadow is seen";
}

TEST(Key, LearnsThePlateWithItsFlicker) {
  std::mt19937 random(2);
  const auto frame_at = [&](double lamp, bool subject) {
    return test::make_frame(FrameFormat::rgbx, 80, 60, [&](int x, int y) {
      if (subject && x > 30 && x < 50 && y > 20) return Colour{200, 40, 40};
      const double glow = y < 10 ? lamp : 0.0;
      const double noise = static_cast<double>(random() % 5) - 2.0;
      return Colour{100 + noise, 110 + 0.9 * glow + noise, 120 + 0.2 * glow + noise};
    });
  };
  Keyer keyer;
  KeySettings settings;
  settings.method = KeyMethod::difference;
  keyer.set(settings);
  keyer.learn_plate(12);
  Matte m;
  for (int i = 0; i < 12; ++i) {
    const test::Frame frame = frame_at(i % 2 ? 40.0 : -40.0, false);
    keyer.prepare(frame.view);
  }
  EXPECT_EQ(keyer.calibration().plate_frames_left, 0);
  keyer.key(frame_at(40.0, true).view, m);
  EXPECT_EQ(m.row(40)[40], 255);
  EXPECT_EQ(m.row(40)[10], 0);
  EXPECT_EQ(m.row(4)[10], 0) << "the lamp";
}

TEST(Key, RegionMasksAndPolygons) {
  const test::Frame frame = test::make_frame(FrameFormat::nv12, 100, 60, [](int x, int y) {
    return x < 70 ? skin : Colour{screen_green[0], screen_green[1] + y % 2, screen_green[2]};
  });
  KeySettings settings;
  settings.roi = {7, 5, 80, 37};
  Matte m = key(settings, frame.view);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 100; ++x)
      ASSERT_EQ(m.row(y)[x] > 127, x >= 7 && x < 70 && y >= 5 && y < 42) << x << "," << y;
  settings.roi = {-10, -10, 1000, 1000};
  EXPECT_GT(area_of(key(settings, frame.view)), 68 * 60);
  settings.roi = {200, 0, 10, 10};
  EXPECT_EQ(area_of(key(settings, frame.view)), 0.0);
  settings.roi = {};

  settings.outside_polygon.points = {{10.f, 10.f}, {50.f, 10.f}, {50.f, 40.f}, {10.f, 40.f}};
  settings.outside_polygon.ends = {4};
  settings.inside_polygon.points = {{40.f, 0.f}, {90.f, 0.f}, {90.f, 20.f}, {40.f, 20.f}};
  settings.inside_polygon.ends = {4};
  m = key(settings, frame.view);
  EXPECT_EQ(m.row(20)[20], 255);
  EXPECT_EQ(m.row(5)[20], 0) << "outside the allowed polygon";
  EXPECT_EQ(m.row(5)[80], 0) << "outside wins over inside";
  settings.outside_polygon = {};
  m = key(settings, frame.view);
  EXPECT_EQ(m.row(5)[80], 255) << "forced";

  auto mask = std::make_shared<Picture>(Picture{100, 60, 1, std::vector<std::uint8_t>(6000, 0)});
  mask->row(30)[30] = 255;
  settings.inside_polygon = {};
  settings.outside_mask = mask;
  m = key(settings, frame.view);
  EXPECT_EQ(m.row(30)[30], 0);
  EXPECT_EQ(m.row(30)[31], 255);
  settings.outside_mask = nullptr;
  settings.inside_mask = mask;
  mask->row(30)[30] = 0;
  mask->row(10)[85] = 255;  // before the screen
  m = key(settings, frame.view);
  EXPECT_EQ(m.row(10)[85], 255);
  EXPECT_EQ(m.row(10)[84], 0);
  EXPECT_EQ(m.row(10)[86], 0);
  settings.inside_mask = nullptr;
  settings.outside_mask =
      std::make_shared<Picture>(Picture{10, 6, 1, std::vector<std::uint8_t>(60, 0)});
  EXPECT_THROW(key(settings, frame.view), Error);
}

TEST(Key, ChokeAndClose) {
  const test::Frame frame = test::make_frame(FrameFormat::bgrx, 121, 91, [](int x, int y) {
    return x == 60 || x == 61 ? screen_green : disk_scene(x, y);  // a slit through the disk
  });
  KeySettings settings;
  const double open = area_of(key(settings, frame.view));
  settings.close = 2.0;
  const double closed = area_of(key(settings, frame.view));
  EXPECT_NEAR(closed, M_PI * 900.0, 40.0);
  EXPECT_LT(open, closed - 80.0);
  const test::Frame disk = test::make_frame(FrameFormat::bgrx, 121, 91, disk_scene);
  settings.close = 0.0;
  for (const double choke : {-4.5, -1.0, 0.5, 3.0, 5.0}) {
    settings.choke = choke;
    const double radius = std::sqrt(area_of(key(settings, disk.view)) / M_PI);
    EXPECT_NEAR(radius, 30.0 - choke, 0.12 * std::abs(choke) + 0.1) << choke;
  }
}

TEST(Key, ClosedGapsTakeTheColoursAround) {
  // Two dark red legs on a green floor; the gap between them is closed, and with it its green.
  const auto floor = [](int, int) { return Colour{40, 160, 60}; };
  const auto legs = [&](int x, int y) {
    const bool leg = y >= 10 && y < 50 && ((x >= 20 && x < 40) || (x >= 44 && x < 64));
    return leg ? Colour{140, 30, 20} : floor(x, y);
  };
  const test::Frame frame = test::make_frame(FrameFormat::rgbx, 90, 60, legs);
  KeySettings settings;
  settings.method = KeyMethod::difference;
  Picture plate{90, 60, 3, {}};
  for (int i = 0; i < 90 * 60; ++i) plate.pixels.insert(plate.pixels.end(), {40, 160, 60});
  settings.plate = std::make_shared<Picture>(plate);
  const auto drawn = [&] {
    Keyer keyer;
    keyer.set(settings);
    Matte matte;
    keyer.key(frame.view, matte);
    std::vector<std::uint8_t> pixels(90 * 60 * 4);
    keyer.write_rgba(frame.view, matte, {0, 0, 90, 60}, KeyView::composite, pixels.data(), 360);
    return pixels;
  };
  const std::vector<std::uint8_t> open = drawn();
  settings.close = 3.0;
  const std::vector<std::uint8_t> closed = drawn();
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 90; ++x) {
      const std::uint8_t *was = &open[4 * (90 * y + x)], *is = &closed[4 * (90 * y + x)];
      const bool gap = x >= 40 && x < 44 && y >= 16 && y < 44;  // off the ends, where it narrows
      if (gap) {
        EXPECT_EQ(was[3], 0) << x << " " << y;
        EXPECT_EQ(is[3], 255) << x << " " << y;
        EXPECT_EQ(std::vector<int>(is, is + 3), (std::vector<int>{140, 30, 20})) << x << " " << y;
      } else if (is[3] == was[3]) {
        EXPECT_EQ(std::vector<int>(is, is + 3), std::vector<int>(was, was + 3)) << x << " " << y;
      } else {
        EXPECT_LT(is[1], 60) << x << " " << y;
      }
    }
  // A part of the frame is the same as in the whole.
  Keyer keyer;
  keyer.set(settings);
  Matte matte;
  keyer.key(frame.view, matte);
  std::uint8_t part[3 * 4];
  keyer.write_rgba(frame.view, matte, {41, 30, 3, 1}, KeyView::composite, part, 12);
  EXPECT_TRUE(std::equal(part, part + 12, &closed[4 * (90 * 30 + 41)]));
  // Without closing nothing of it stays.
  settings.close = 0.0;
  keyer.set(settings);
  keyer.key(frame.view, matte);
  keyer.write_rgba(frame.view, matte, {41, 30, 3, 1}, KeyView::composite, part, 12);
  EXPECT_TRUE(std::equal(part, part + 12, &open[4 * (90 * 30 + 41)]));
}

TEST(Key, DespillAndViews) {
  const Colour spilled{120, 170, 100};
  const test::Frame frame = test::make_frame(
      FrameFormat::bgrx, 40, 4, [&](int x, int) { return x < 20 ? spilled : screen_green; });
  Keyer keyer;
  KeySettings settings;
  settings.screen = rgb(screen_green);
  settings.foreground = Rgb{120, 120, 120};
  keyer.set(settings);
  Matte m;
  keyer.key(frame.view, m);
  std::vector<std::uint8_t> out(40 * 4 * 4);
  const auto show = [&](KeyView view) {
    keyer.write_rgba(frame.view, m, {0, 0, 40, 4}, view, out.data(), 160);
    return std::array<int, 4>{out[0], out[1], out[2], out[3]};
  };
  const int alpha = m.row(0)[0];
  EXPECT_GT(alpha, 100);
  EXPECT_LT(alpha, 255);
  // Without the screen's share the green is still more than it may be.
  EXPECT_EQ(show(KeyView::composite), (std::array<int, 4>{153, 153, 117, alpha}));
  EXPECT_EQ(show(KeyView::matte), (std::array<int, 4>{alpha, alpha, alpha, 255}));
  EXPECT_EQ(show(KeyView::spill), (std::array<int, 4>{0, 4, 0, 255}));
  EXPECT_EQ(show(KeyView::status), (std::array<int, 4>{alpha, 64, 255 - alpha, 255}));
  const std::uint8_t* background = out.data() + 4 * 30;
  EXPECT_EQ((std::array<int, 4>{background[0], background[1], background[2], background[3]}),
            (std::array<int, 4>{0, 0, 0, 255}));
}

TEST(Key, OddSizesAndStrides) {
  for (const FrameFormat format : test::all_formats)
    for (const auto& [w, h] :
         {std::pair{1, 1}, {2, 1}, {1, 3}, {15, 2}, {16, 3}, {17, 5}, {33, 7}}) {
      const test::Frame frame =
          test::make_frame(format, w, h, [](int x, int) { return x % 2 ? skin : screen_green; });
      KeySettings settings;
      settings.screen = rgb(screen_green);
      settings.foreground = rgb(skin);
      const Matte m = key(settings, frame.view);
      EXPECT_EQ(m.row(0)[0] < 200, true) << name_of(format) << w << "x" << h;
      if (!is_yuv(format)) {
        for (int x = 0; x < w; ++x) EXPECT_EQ(m.row(h - 1)[x], x % 2 ? 255 : 0) << name_of(format);
      }
    }
}

TEST(Key, RowsMayRunUpwards) {
  // Memory read from its last row on, as bottom-up frames are, is the picture upside down.
  for (const FrameFormat format : test::all_formats) {
    const test::Frame frame = test::make_frame(format, 121, 90, disk_scene);
    FrameView flipped = frame.view;
    for (int plane = 0; plane < 3; ++plane) {
      if (frame.planes[plane].empty()) continue;
      const bool halved = plane > 0 && is_yuv(format) && !is_422(format);
      flipped.planes[plane] += frame.view.strides[plane] * ((halved ? 45 : 90) - 1);
      flipped.strides[plane] = -frame.view.strides[plane];
    }
    KeySettings settings;
    settings.screen = rgb(screen_green);
    settings.foreground = rgb(skin);
    const Matte up = key(settings, flipped), down = key(settings, frame.view);
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 121; ++x)
        ASSERT_EQ(up.row(y)[x], down.row(89 - y)[x]) << name_of(format) << " " << x << "," << y;
    SilhouetteSettings all;
    all.key = settings;
    Silhouetter silhouetter;
    silhouetter.set(all);
    EXPECT_NEAR(test::total_area(silhouetter.process(flipped)), M_PI * 900.0, 30.0)
        << name_of(format);
  }
}

TEST(Key, RefusesNonsense) {
  Keyer keyer;
  KeySettings settings;
  settings.clip_black = 0.9;
  settings.clip_white = 0.2;
  EXPECT_THROW(keyer.set(settings), Error);
  settings = {};
  settings.choke = std::nan("");
  EXPECT_THROW(keyer.set(settings), Error);
  settings = {};
  settings.method = KeyMethod::difference;
  settings.plate = std::make_shared<Picture>(Picture{3, 3, 3, std::vector<std::uint8_t>(27)});
  keyer.set(settings);
  const test::Frame frame =
      test::make_frame(FrameFormat::rgbx, 8, 8, [](int, int) { return skin; });
  Matte m;
  EXPECT_THROW(keyer.key(frame.view, m), Error);
  FrameView broken = frame.view;
  broken.planes[0] = nullptr;
  EXPECT_THROW(check_frame(broken), Error);
  broken = frame.view;
  broken.strides[0] = 4;
  EXPECT_THROW(check_frame(broken), Error);
  broken.width = 40000;
  EXPECT_THROW(check_frame(broken), Error);
}

}  // namespace
}  // namespace polyhull
