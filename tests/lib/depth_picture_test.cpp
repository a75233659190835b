// SPDX-License-Identifier: LGPL-2.1-or-later
// What a background's maker tells of its depth hides subjects, in every backend alike.
#include "render/depth_picture.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "backend.h"
#include "figure_stage.h"
#include "render/lens/depth_layers.h"
#include "render/lens/lens_picture.h"

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

// With a lens that distorts, of the picture as it comes and goes out: a border far from the middle.
TEST_P(DepthPictureTest, GoesThroughTheLens) {
  const auto renderer = make_renderer();
  stage_.frame.viewport.distortion = {-0.2, 0.05, 0.0, 0.0};
  constexpr int border = height / 4, beside = 4;  // beside it pixels are put together of both sides
  const auto draw_lens = [&](float inverse) {
    RenderFrame frame = stage_.frame;
    if (inverse > 0.0f) {
      auto depth = std::make_shared<DepthPicture>(DepthPicture{width, height, {}});
      for (int i = 0; i < width * height; ++i)
        depth->inverse.push_back(i < width * border ? inverse : 0.0f);
      frame.depth = depth;
    }
    LensPicture lens;
    lens.set(frame, {});
    Picture out = stage_.background;
    const RenderPlan plan = renderer->plan(frame, settings_);
    lens.draw(frame, plan, 0, stage_.background.pixels.data(), 4 * width, out.pixels.data(),
              4 * width,
              [&](const RenderPlan& part, const std::uint8_t* from, int from_stride,
                  std::uint8_t* to, int to_stride) {
                renderer->render(frame, part, settings_, from, from_stride, to, to_stride);
              });
    return out;
  };
  const Picture open = draw_lens(0.0f), part = draw_lens(5.0f);
  const auto same_rows = [](const Picture& a, const Picture& b, int y0, int y1) {
    return std::memcmp(a.row(y0), b.row(y0), 4 * std::size_t{width} * (y1 - y0)) == 0;
  };
  ASSERT_FALSE(same_rows(open, stage_.background, border - beside - 1, border - beside));
  ASSERT_FALSE(same_rows(open, stage_.background, border + beside, border + beside + 1));
  EXPECT_TRUE(same_rows(part, stage_.background, 0, border - beside));
  EXPECT_TRUE(same_rows(part, open, border + beside, height));
}

// For depth of field: the nearer of what the scene has and what the picture tells.
TEST(DepthLayers, HeedTheDepthPicture) {
  synthetic::FigureStage stage(width, height);
  DepthLayers layers;
  layers.set(stage.frame, {});
  const std::vector<float> scene = layers.scene();
  auto depth = std::make_shared<DepthPicture>(DepthPicture{width, height, scene});
  for (std::size_t i = 0; i < scene.size(); ++i)
    depth->inverse[i] *= i % 3 == 0 ? 1.5f : i % 3 == 1 ? 1.01f : 0.5f;
  stage.frame.depth = depth;
  layers.set(stage.frame, {});
  ASSERT_EQ(layers.scene().size(), scene.size());
  for (std::size_t i = 0; i < scene.size(); ++i)
    ASSERT_EQ(layers.scene()[i], i % 3 == 0 ? 1.5f * scene[i] : scene[i]) << i;
  stage.frame.depth.reset();
  layers.set(stage.frame, {});
  EXPECT_EQ(layers.scene(), scene);
}

INSTANTIATE_TEST_SUITE_P(Backends, DepthPictureTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
