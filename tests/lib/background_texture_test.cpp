// SPDX-License-Identifier: LGPL-2.1-or-later
// What OpenGL uploads of the background: only what has changed of it, and the picture is the same.
#include "render/gl/background_texture.h"

#include <gtest/gtest.h>

#include "backend.h"
#include "figure_stage.h"
#include "render/gl/tiles.h"

namespace polyhull {
namespace {

constexpr int width = 320, height = 180;
constexpr std::uint64_t tile_bytes = 4 * tile_side * tile_side;

class BackgroundTextureTest : public testing::BackendTest {
 protected:
  /// Draws the stage's frame, and holds it against the picture of a compositor that knows nothing
  /// yet. Returns how many bytes of the background were uploaded.
  std::uint64_t draw(const RenderSettings& settings = {}) {
    if (!compositor_) compositor_ = std::make_unique<Compositor>();
    const Picture picture = stage.composite(*compositor_, settings);
    const RenderStatistics statistics = compositor_->statistics();
    Compositor other;
    EXPECT_EQ(picture.pixels, stage.composite(other, settings).pixels);
    EXPECT_GT(other.statistics().background_bytes_uploaded, 0u);
    EXPECT_GE(statistics.bytes_uploaded, statistics.background_bytes_uploaded);
    return statistics.background_bytes_uploaded;
  }
  void move_subject(double x) { stage.frame.subjects[0].placement.translate.x = x; }

  synthetic::FigureStage stage{width, height};

 private:
  std::unique_ptr<Compositor> compositor_;
};

TEST_P(BackgroundTextureTest, AStillPictureIsUploadedOnce) {
  stage.fill_background(90);
  for (const std::uint64_t number : {0, 7}) {  // compared, and told
    stage.frame.background_content = number;
    move_subject(0.0);
    const std::uint64_t first = draw();
    EXPECT_EQ(first, number == 0 ? 4u * width * height : 0u) << "a polished floor shows all of it";
    for (const double x : {0.0, 0.3, -0.4}) {
      move_subject(x);
      EXPECT_EQ(draw(), 0u) << x << ", number " << number;
    }
  }
}

TEST_P(BackgroundTextureTest, WhatChangesIsUploadedByTiles) {
  stage.fill_background(90);
  draw();
  // Tiles in two rows of them, the lower one two apart: with what lies between.
  for (const auto& [x, y] : {std::pair{0, 0}, {40, 70}, {4 * 32 - 1, 95}})
    stage.background.pixels[4 * (static_cast<std::size_t>(y) * width + x)] = 91;
  EXPECT_EQ(draw(), (1 + 3) * tile_bytes);
  EXPECT_EQ(draw(), 0u);
  stage.background.pixels.back() = 3;  // of the last tile, whose rows end with the picture
  EXPECT_EQ(draw(), 4u * 32 * (180 - 160));
  EXPECT_EQ(draw(), 0u);
}

TEST_P(BackgroundTextureTest, AnotherNumberIsLookedAtAnew) {
  stage.fill_background(90);
  stage.frame.background_content = 1;
  draw();
  stage.fill_background(120);
  stage.frame.background_content = 2;
  EXPECT_EQ(draw(), 4u * width * height);
  stage.frame.background_content = 3;
  EXPECT_EQ(draw(), 0u) << "another number of the same pixels";
  stage.fill_background(90);
  stage.frame.background_content = 0;
  EXPECT_EQ(draw(), 4u * width * height);
}

TEST_P(BackgroundTextureTest, WithoutAMirrorOnlyWhatIsDrawnOver) {
  RenderSettings settings;
  settings.mirror = MirrorMode::off;
  settings.shadow = ShadowQuality::off;
  stage.fill_background(90);
  stage.frame.background_content = 1;
  const std::uint64_t first = draw(settings);
  EXPECT_LT(first, 4u * width * height / 2);
  EXPECT_EQ(draw(settings), 0u);
  move_subject(1.2);  // to where nothing was uploaded
  EXPECT_GT(draw(settings), 0u);
  EXPECT_EQ(draw(settings), 0u);
  // Tiles outside of what the other picture drew over still show the first one.
  stage.fill_background(60);
  stage.frame.background_content = 2;
  EXPECT_GT(draw(settings), 0u);
  move_subject(0.0);
  EXPECT_GT(draw(settings), 0u);
  EXPECT_EQ(draw(settings), 0u);
}

TEST_P(BackgroundTextureTest, WithoutSkippingAllOfItEveryTime) {
  RenderSettings settings;
  settings.skip = false;
  stage.fill_background(90);
  stage.frame.background_content = 1;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(draw(settings), 4u * width * height);
}

INSTANTIATE_TEST_SUITE_P(Api, BackgroundTextureTest,
                         ::testing::Values(testing::Backend::desktop, testing::Backend::embedded),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
