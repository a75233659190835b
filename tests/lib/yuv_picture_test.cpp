// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/yuv/yuv_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "backend.h"
#include "base/instruction_set.h"
#include "base/thread_pool.h"
#include "render/yuv/loops.h"
#include "synthetic.h"
#include "texture/texture_hull.h"

namespace polyhull {
namespace {

/// A 4:2:0 picture with memory of its own: a gap after each row must stay as it is.
struct Video {
  static constexpr int gap = 5;
  static constexpr std::uint8_t untouched = 77;
  std::vector<std::uint8_t> y, chroma;
  YuvPicture picture;

  Video(int width, int height, bool in_turn) {
    const int across = (width + 1) / 2, down = (height + 1) / 2;
    picture.width = width;
    picture.height = height;
    picture.y_stride = width + gap;
    picture.chroma_step = in_turn ? 2 : 1;
    picture.chroma_stride = across * picture.chroma_step + gap;
    y.assign(static_cast<std::size_t>(picture.y_stride * height), untouched);
    const auto plane = static_cast<std::size_t>(picture.chroma_stride * down);
    chroma.assign(in_turn ? plane : 2 * plane, untouched);
    picture.y = y.data();
    picture.cb = chroma.data();
    picture.cr = chroma.data() + (in_turn ? 1 : plane);
  }
  Video(const Video&) = delete;
  bool operator==(const Video& other) const { return y == other.y && chroma == other.chroma; }
};

/// Noise, and saturated pixels, where rounding and clipping show.
std::vector<std::uint8_t> noise(int width, int height) {
  std::mt19937 random(static_cast<unsigned>(width * 1000 + height));
  std::vector<std::uint8_t> rgba(static_cast<std::size_t>(width) * height * 4);
  for (std::size_t i = 0; i < rgba.size(); ++i)
    rgba[i] = static_cast<std::uint8_t>(i / 32 % 2 ? random() : (random() & 1) * 255);
  return rgba;
}

/// The formulae of yuv_picture.h in double precision, before rounding.
struct Reference {
  const std::vector<std::uint8_t>& rgba;
  int width, height;
  double at(int x, int y, int k) const {
    x = std::clamp(x, 0, width - 1);
    y = std::clamp(y, 0, height - 1);
    return rgba[(static_cast<std::size_t>(y) * width + x) * 4 + k] / 255.0;
  }
  static double luma(double r, double g, double b) { return 0.2126 * r + 0.7152 * g + 0.0722 * b; }
  double y(int x, int row) const {
    return 16.0 + 219.0 * luma(at(x, row, 0), at(x, row, 1), at(x, row, 2));
  }
  /// Cb (k = 2) or Cr (k = 0) of the pair that begins at pixel (x, y).
  double chroma(int x, int y, int k) const {
    double mean[3] = {0.0, 0.0, 0.0};
    for (int c = 0; c < 3; ++c)
      for (int row = 0; row < 2; ++row)
        mean[c] += (at(x - 1, y + row, c) + 2.0 * at(x, y + row, c) + at(x + 1, y + row, c)) / 8.0;
    const double difference = mean[k] - luma(mean[0], mean[1], mean[2]);
    return 128.0 + 224.0 * difference / (k == 2 ? 1.8556 : 1.5748);
  }
};

void expect_as_reference(int width, int height, bool in_turn) {
  SCOPED_TRACE(::testing::Message() << width << " x " << height << (in_turn ? ", NV12" : ", I420"));
  const std::vector<std::uint8_t> rgba = noise(width, height);
  Video video(width, height, in_turn);
  const YuvPicture& out = video.picture;
  write_yuv(rgba.data(), 4 * width, out);
  const Reference reference{rgba, width, height};
  double worst = 0.0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      worst = std::max(worst, std::abs(out.y[y * out.y_stride + x] - reference.y(x, y)));
  for (int y = 0; y < height; y += 2)
    for (int x = 0; x < width; x += 2) {
      const std::ptrdiff_t at = y / 2 * out.chroma_stride + x / 2 * out.chroma_step;
      worst = std::max({worst, std::abs(out.cb[at] - reference.chroma(x, y, 2)),
                        std::abs(out.cr[at] - reference.chroma(x, y, 0))});
    }
  EXPECT_LT(worst, 0.51);  // rounded to the nearest
  for (int y = 0; y < height; ++y)
    for (int i = 0; i < Video::gap; ++i)
      ASSERT_EQ(out.y[y * out.y_stride + width + i], Video::untouched);
}

TEST(YuvPicture, IsTheFormulaRounded) {
  for (const bool in_turn : {false, true}) {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {2, 1}, {1, 2}, {3, 3}, {16, 2}, {33, 17}, {258, 131}, {640, 100}})
      expect_as_reference(width, height, in_turn);
  }
}

TEST(YuvPicture, BlackWhiteAndGreyAreWhatTheyShouldBe) {
  for (const int grey : {0, 1, 127, 128, 254, 255}) {
    std::vector<std::uint8_t> rgba(4 * 4 * 2, static_cast<std::uint8_t>(grey));
    Video video(4, 2, true);
    write_yuv(rgba.data(), 16, video.picture);
    EXPECT_EQ(video.picture.y[0], std::lround(16.0 + 219.0 * grey / 255.0));
    EXPECT_EQ(video.picture.cb[0], 128);
    EXPECT_EQ(video.picture.cr[0], 128);
  }
}

/// What changes with some pixels is what yuv_part() says, and nothing beside it.
TEST(YuvPicture, PartsMakeTheWhole) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    const int width = 1 + static_cast<int>(random() % 40),
              height = 1 + static_cast<int>(random() % 20);
    const bool in_turn = round % 2 == 0;
    std::vector<std::uint8_t> rgba = noise(width, height);
    Video video(width, height, in_turn), whole(width, height, in_turn);
    write_yuv(rgba.data(), 4 * width, video.picture);
    Rectangle changed{static_cast<int>(random() % width), static_cast<int>(random() % height), 0,
                      0};
    changed.width = 1 + static_cast<int>(random() % (width - changed.x));
    changed.height = 1 + static_cast<int>(random() % (height - changed.y));
    for (int y = changed.y; y < changed.y + changed.height; ++y)
      for (int i = 4 * changed.x; i < 4 * (changed.x + changed.width); ++i)
        rgba[static_cast<std::size_t>(4 * width * y + i)] ^= 0x5a;
    write_yuv({rgba.data(), 4 * width, 0, 0}, yuv_part(changed, width, height), video.picture);
    write_yuv(rgba.data(), 4 * width, whole.picture);
    ASSERT_TRUE(video == whole) << changed.x << "," << changed.y << " " << changed.width << " x "
                                << changed.height << " of " << width << " x " << height;
  }
  EXPECT_TRUE(yuv_part({}, 10, 10).empty());
}

TEST(YuvPicture, InstructionSetsAgree) {
#if defined(__x86_64__)
  if (!may_use_avx2()) GTEST_SKIP();
  const std::vector<std::uint8_t> rgba = noise(200, 2);
  const std::uint8_t *top = rgba.data() + 4, *bottom = rgba.data() + 804;
  for (int count = 0; count <= 99; ++count) {
    std::vector<std::uint8_t> out[2] = {std::vector<std::uint8_t>(1000, 9),
                                        std::vector<std::uint8_t>(1000, 9)};
    int i = 0;
    for (const yuv::Loops* loops : {&yuv::Loops::baseline(), &yuv::Loops::avx2()}) {
      std::uint8_t* to = out[i++].data();
      loops->luma(top, count, to);
      loops->chroma(top, bottom, count, to + 200, to + 400);
      loops->chroma_in_turn(top, bottom, count, to + 600);
    }
    ASSERT_EQ(out[0], out[1]) << count;
  }
#endif
}

class RenderedVideo : public testing::BackendTest {};

/// What is written as video is the RGBA picture converted, to the bit, with any number of threads.
TEST_P(RenderedVideo, IsThePictureConverted) {
  synthetic::Photographed subject = synthetic::photographed(
      synthetic::figure(8), synthetic::ring(3, 3.2, 1.5, {0, 1, 0}, 128, 128, 60.0));
  std::vector<Camera> cameras;
  for (const MeshView& view : subject.mesh.views) cameras.push_back(view.calibration);
  subject.mesh.texturing = texture_hull(subject.mesh.hull, cameras);
  RenderFrame frame;
  frame.width = 333;
  frame.height = 187;
  frame.viewport =
      synthetic::look_at({1.3, 1.5, 4.2}, {0.0, 0.9, 0.0}, frame.width, frame.height, 50.0);
  frame.scene = std::make_shared<const Scene>(synthetic::small_room(true));
  frame.lights = frame.scene->lights;
  frame.exposure = frame.scene->exposure;
  frame.subjects.push_back({&subject.mesh, {}, 0});
  const std::vector<std::uint8_t> background = noise(frame.width, frame.height);
  const auto renderer = make_renderer();
  const int stride = 4 * frame.width, threads = pool_threads();
  for (const double aside : {0.0, 0.31, 0.87}) {
    frame.subjects[0].placement.translate = {aside, 0.0, 0.0};
    const RenderPlan plan = renderer->plan(frame, {});
    ASSERT_FALSE(plan.untouched());
    std::vector<std::uint8_t> rgba = background;
    renderer->render(frame, plan, {}, background.data(), stride, rgba.data(), stride);
    for (const bool in_turn : {false, true}) {
      Video expected(frame.width, frame.height, in_turn), video(frame.width, frame.height, in_turn);
      write_yuv(rgba.data(), stride, expected.picture);
      write_yuv(background.data(), stride, video.picture);
      EXPECT_FALSE(video == expected);
      set_pool_threads(in_turn ? 1 : threads);
      renderer->render_yuv(frame, plan, {}, background.data(), stride, video.picture);
      EXPECT_TRUE(video == expected) << aside << " aside" << (in_turn ? ", NV12" : ", I420");
    }
    set_pool_threads(threads);
  }
}

INSTANTIATE_TEST_SUITE_P(Api, RenderedVideo, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

}  // namespace
}  // namespace polyhull
