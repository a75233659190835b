// SPDX-License-Identifier: LGPL-2.1-or-later
// What a background's maker tells of its depth hides subjects, in every backend alike.
#include "render/depth_picture.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "backend.h"
#include "figure_stage.h"

namespace polyhull {
namespace {

constexpr int width = 320, height = 180;

class DepthPictureTest : public testing::BackendTest {
 protected:
  DepthPictureTest() {
    stage_.fill_background(90);
    settings_.shadow = ShadowQuality::off;
    settings_.mirror = MirrorMode::off;
  }
  /// The composite where the left \p columns of 16 are \p inverse (1/m), the others nothing.
  Picture draw(Renderer& renderer, float inverse, int columns = 16) {
    auto depth = std::make_shared<DepthPicture>();
    depth->width = width / 2;
    depth->height = height / 4;
    for (int y = 0; y < depth->height; ++y)
      for (int x = 0; x < depth->width; ++x)
        depth->inverse.push_back(x < depth->width * columns / 16 ? inverse : 0.0f);
    stage_.frame.depth = depth;
    Picture out = stage_.composite(renderer, settings_);
    stage_.frame.depth.reset();
    return out;
  }
  static bool same(const Picture& a, const Picture& b, int x0, int x1) {
    for (int y = 0; y < height; ++y)
      if (std::memcmp(a.row(y) + 4 * x0, b.row(y) + 4 * x0, 4 * static_cast<std::size_t>(x1 - x0)))
        return false;
    return true;
  }
  /// Pixels of which a colour differs by more than \p least levels.
  static int differ(const Picture& a, const Picture& b, int least) {
    int count = 0;
    for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
      int most = 0;
      for (std::size_t c = i; c < i + 3; ++c)
        most = std::max(most, std::abs(a.pixels[c] - b.pixels[c]));
      count += most > least;
    }
    return count;
  }

  synthetic::FigureStage stage_{width, height};
  RenderSettings settings_;
};

TEST_P(DepthPictureTest, HidesWhatIsBehind) {
  const auto renderer = make_renderer();
  const Picture open = stage_.composite(*renderer, settings_);
  ASSERT_FALSE(same(open, stage_.background, 0, width / 2));
  ASSERT_FALSE(same(open, stage_.background, width / 2, width));
  EXPECT_EQ(draw(*renderer, 0.0f).pixels, open.pixels);               // nothing there
  EXPECT_EQ(draw(*renderer, 0.001f).pixels, open.pixels);             // behind the room
  EXPECT_EQ(draw(*renderer, 5.0f).pixels, stage_.background.pixels);  // before all
  const Picture half = draw(*renderer, 5.0f, 8);
  EXPECT_TRUE(same(half, stage_.background, 0, width / 2));
  EXPECT_TRUE(same(half, open, width / 2, width));
  EXPECT_EQ(stage_.composite(*renderer, settings_).pixels, open.pixels);
}

// Planes through the room and the figure.
TEST_P(DepthPictureTest, BackendsAgree) {
  if (processor()) GTEST_SKIP() << "the others are held against it";
  const auto own = make_renderer();
  ProcessorRenderer reference;
  const int open = differ(draw(*own, 0.0f), draw(reference, 0.0f), 24);
  int parts = 0, before = -1;
  for (float inverse = 0.15f; inverse < 0.6f; inverse += 0.003f) {
    const Picture picture = draw(*own, inverse);
    EXPECT_LE(differ(picture, draw(reference, inverse), 24), open + 4) << inverse;
    const int shown = differ(picture, stage_.background, 0);
    parts += before >= 0 && shown < before;
    if (before >= 0) {
      EXPECT_LE(shown, before + 3) << inverse;
    }
    before = shown;
  }
  EXPECT_GT(parts, 5);  // so many of the planes cut it
}

INSTANTIATE_TEST_SUITE_P(Backends, DepthPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
