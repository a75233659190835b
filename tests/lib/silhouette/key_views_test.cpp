// SPDX-License-Identifier: LGPL-2.1-or-later
// The operator's aids: how clear a matte is, and four pictures in one.
#include <gtest/gtest.h>

#include "key_checks.h"
#include "silhouette/key/key_score.h"

namespace polyhull {
namespace {

using test::Colour;
using test::matte_of;
using test::mix;
using test::rgb;

TEST(KeyScore, CountsWhatIsNeitherBlackNorWhiteOffTheEdges) {
  // A subject of 40 x 40 in 100 x 100, its edge three pixels wide.
  const auto subject = [](int x, int y) {
    const int inside = std::min({x - 30, 69 - x, y - 30, 69 - y});
    return std::clamp(64 * (inside + 2), 0, 255);
  };
  const Rectangle whole{0, 0, 100, 100};
  const KeyScore clear = score_of(matte_of(100, 100, subject), whole);
  EXPECT_EQ(clear.score(), 100.0);
  EXPECT_EQ(clear.doubtful_screen + clear.doubtful_subject, 0.0);
  EXPECT_NEAR(clear.subject, 0.16, 0.01);

  const KeyScore dirty = score_of(matte_of(100, 100,
                                           [&](int x, int y) {
                                             if (x < 10 && y < 10) return 30;  // 100 px
                                             if (x >= 48 && x < 52 && y >= 48 && y < 52) return 200;
                                             return subject(x, y);
                                           }),
                                  whole);
  EXPECT_NEAR(dirty.doubtful_subject, 0.0016, 1e-9);
  // Its rim is beside the black screen, but no white is near.
  EXPECT_NEAR(dirty.doubtful_screen, 0.01, 1e-9);
  EXPECT_NEAR(dirty.score(), 100.0 * (1.0 - 0.0116 / dirty.subject), 1e-6);
  // Of a part of the picture.
  EXPECT_EQ(score_of(matte_of(100, 100, [](int, int) { return 0; }), {3, 5, 20, 7}).score(), 100.0);
  EXPECT_EQ(score_of(matte_of(100, 100, [](int, int) { return 99; }), whole).score(), 0.0);
  EXPECT_EQ(score_of(matte_of(10, 10, [](int, int) { return 99; }), {}).subject, 0.0);
}

TEST(KeyViews, SplitShowsFrameMatteStatusAndResult) {
  const Colour screen{60, 190, 70}, subject{190, 130, 110};
  const auto colour = [&](int x, int y) {
    return mix(screen, subject, x > 60 && y > 30 ? 1.0 : 0.0);
  };
  for (const auto& [width, height] : {std::pair{160, 128}, {161, 129}}) {
    const test::Frame frame = test::make_frame(FrameFormat::rgbx, width, height, colour);
    Keyer keyer;
    KeySettings settings;
    settings.screen = rgb(screen);
    settings.foreground = rgb(subject);
    keyer.set(settings);
    Matte matte;
    keyer.key(frame.view, matte);
    std::vector<std::uint8_t> shown(4 * static_cast<std::size_t>(width) * height);
    keyer.write_rgba(frame.view, matte, {0, 0, width, height}, KeyView::split, shown.data(),
                     4 * width);
    const int left = (width + 1) / 2, top = (height + 1) / 2;
    const auto at = [&](int x, int y) {
      const std::uint8_t* p = &shown[4 * (static_cast<std::size_t>(width) * y + x)];
      EXPECT_EQ(p[3], 255);
      return Rgb{p[0], p[1], p[2]};
    };
    EXPECT_EQ(at(5, 5), rgb(screen));
    EXPECT_EQ(at(60, 40), rgb(subject));
    EXPECT_EQ(at(left + 5, 5), (Rgb{0, 0, 0}));
    EXPECT_EQ(at(left + 60, 40), (Rgb{255, 255, 255}));
    EXPECT_EQ(at(5, top + 5), (Rgb{0, 0, 0}));
    EXPECT_EQ(at(60, top + 40), (Rgb{255, 255, 255}));
    EXPECT_EQ(at(left + 5, top + 5), (Rgb{128, 128, 128}));
    EXPECT_EQ(at(left + 60, top + 40), rgb(subject));
    // The colours found, side by side in the frame's lower left.
    EXPECT_EQ(at(8, top - 8), rgb(screen));
    EXPECT_EQ(at(16, top - 8), rgb(subject));
    EXPECT_EQ(at(4, top - 12), (Rgb{255, 255, 255}));
  }
  // The smallest pictures.
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 1}, {1, 3}, {3, 2}}) {
    const test::Frame frame = test::make_frame(FrameFormat::nv12, width, height, colour);
    Keyer keyer;
    Matte matte;
    keyer.key(frame.view, matte);
    std::vector<std::uint8_t> shown(4 * static_cast<std::size_t>(width) * height + 1, 7);
    keyer.write_rgba(frame.view, matte, {0, 0, width, height}, KeyView::split, shown.data(),
                     4 * width);
    for (int i = 0; i < width * height; ++i)
      EXPECT_EQ(shown[4 * i + 3], 255) << width << "x" << height;
    EXPECT_EQ(shown.back(), 7);
  }
}

}  // namespace
}  // namespace polyhull
