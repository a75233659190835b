// SPDX-License-Identifier: LGPL-2.1-or-later
// Composites over backgrounds that are not opaque: a fill and its key.
#include "render/fill.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "backend.h"
#include "figure_stage.h"

namespace polyhull {
namespace {

using FillTest = testing::BackendTest;
using Stage = synthetic::FigureStage;

/// One of all cases: they change its background alone.
Stage& stage() {
  static Stage made(320, 180);
  return made;
}

void fill(Picture& picture, const std::array<int, 4>& rgba) {
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = static_cast<std::uint8_t>(rgba[i % 4]);
}

Picture composite_over(Renderer& renderer, const std::array<int, 4>& rgba,
                       const RenderSettings& settings) {
  stage().fill_background(0);
  fill(stage().background, rgba);
  return stage().composite(renderer, settings);
}

/// What a keyer makes of \p picture over a grey, in codes.
int keyed(const Picture& picture, std::size_t at, int grey, AlphaCoding alpha) {
  const double key = picture.pixels[at | 3] / 255.0;
  const double part =
      alpha == AlphaCoding::premultiplied ? picture.pixels[at] : key * picture.pixels[at];
  return static_cast<int>(std::lround(part + (1.0 - key) * grey));
}

/// The largest difference between what a keyer makes of \p fill over \p grey and \p direct, among
/// colours of pixels whose key is \p least to \p most.
int worst(const Picture& fill, const Picture& direct, int grey, AlphaCoding alpha, int least = 0,
          int most = 255) {
  int out = 0;
  for (std::size_t i = 0; i < fill.pixels.size(); ++i) {
    if (i % 4 == 3 || fill.pixels[i | 3] < least || fill.pixels[i | 3] > most) continue;
    out = std::max(out, std::abs(keyed(fill, i, grey, alpha) - direct.pixels[i]));
  }
  return out;
}

RenderSettings all_layers() {
  RenderSettings settings;
  settings.alpha = AlphaCoding::straight;
  return settings;
}

RenderSettings subject_alone(AlphaCoding alpha = AlphaCoding::straight) {
  RenderSettings settings;
  settings.shadow = ShadowQuality::off;
  settings.mirror = MirrorMode::off;
  settings.alpha = alpha;
  return settings;
}

int count(const Picture& picture, const auto& is) {
  int out = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); i += 4) out += is(&picture.pixels[i]);
  return out;
}

TEST_P(FillTest, OverTheMiddleGreyItIsTheDirectComposite) {
  const auto renderer = make_renderer();
  for (const AlphaCoding alpha : {AlphaCoding::straight, AlphaCoding::premultiplied}) {
    const RenderSettings settings = subject_alone(alpha);
    const Picture made = composite_over(*renderer, {0, 0, 0, 0}, settings);
    EXPECT_GT(count(made, [](const std::uint8_t* p) { return p[3] > 0 && p[3] < 255; }), 100);
    const Picture direct = composite_over(*renderer, {128, 128, 128, 255}, settings);
    EXPECT_LE(worst(made, direct, 128, alpha), 1);
    // Between 64 and 192 nearer than coverage and own colours, mixed as codes, would be.
    for (const int grey : {64, 192}) {
      const Picture other = composite_over(*renderer, {grey, grey, grey, 255}, settings);
      EXPECT_LE(worst(made, other, grey, alpha), 23) << grey;
    }
  }
}

// As if the background had been put over the grey before.
TEST_P(FillTest, TranslucentBackgroundsAreBetween) {
  const auto renderer = make_renderer();
  for (const AlphaCoding alpha : {AlphaCoding::straight, AlphaCoding::premultiplied}) {
    const bool times = alpha == AlphaCoding::premultiplied;
    for (const int b : {1, 60, 128, 250}) {
      const std::array<int, 4> glass{times ? 9 * b / 10 : 230, times ? b / 4 : 64, 0, b};
      const Picture made = composite_over(*renderer, glass, subject_alone(alpha));
      std::array<int, 4> below{0, 0, 0, 255};
      for (std::size_t c = 0; c < 3; ++c) below[c] = keyed(stage().background, c, 128, alpha);
      const Picture direct = composite_over(*renderer, below, subject_alone(alpha));
      EXPECT_LE(worst(made, direct, 128, alpha), 1) << b;
      EXPECT_EQ(count(made, [&](const std::uint8_t* p) { return p[3] < b; }), 0);
    }
  }
}

// A pixel that is opaque comes out as if alpha were unknown, beside pixels that are not.
TEST_P(FillTest, OpaquePixelsAreAsEver) {
  const auto renderer = make_renderer();
  RenderSettings settings;
  settings.mirror = MirrorMode::plain;  // which looks at no other pixel of the background
  // White, from which shadows take little, and nearly black, too.
  for (const std::array<int, 4>& background :
       {std::array{90, 120, 60, 255}, {255, 255, 255, 255}, {1, 2, 3, 255}}) {
    settings.alpha = AlphaCoding::ignored;
    const Picture all = composite_over(*renderer, background, settings);
    settings.alpha = AlphaCoding::straight;
    EXPECT_EQ(composite_over(*renderer, background, settings).pixels, all.pixels);
    Picture& striped = stage().background;
    for (std::size_t i = 3; i < striped.pixels.size(); i += 12) striped.pixels[i] = 77;
    const Picture mixed = stage().composite(*renderer, settings);
    std::size_t others = 0;
    for (std::size_t i = 0; i < all.pixels.size(); ++i)
      others += i % 12 > 3 && mixed.pixels[i] != all.pixels[i];
    EXPECT_EQ(others, 0u);
  }
}

// The shadow is black and takes as much as over the picture of the scene itself.
TEST_P(FillTest, ShadowsAreInTheKey) {
  const auto renderer = make_renderer();
  RenderSettings settings = all_layers();
  settings.mirror = MirrorMode::off;
  const Picture made = composite_over(*renderer, {0, 0, 0, 0}, settings);
  const Picture without = composite_over(*renderer, {0, 0, 0, 0}, subject_alone());
  stage().trace_background(4, 2);
  const Picture lit = stage().background, direct = stage().composite(*renderer, settings);
  int values = 0, brightest = 0;
  double depth = 0.0, off = 0.0, deepest = 0.0;
  for (std::size_t i = 0; i < made.pixels.size(); ++i) {
    if (i % 4 == 3 || without.pixels[i | 3] > 0 || made.pixels[i | 3] == 0) continue;
    brightest = std::max<int>(brightest, made.pixels[i]);
    if (lit.pixels[i] - direct.pixels[i] < 3) continue;
    ++values;
    depth += lit.pixels[i] - direct.pixels[i];
    off += std::abs(keyed(made, i, lit.pixels[i], settings.alpha) - direct.pixels[i]);
    deepest = std::max<double>(deepest, made.pixels[i | 3]);
  }
  ASSERT_GT(values, 5000);
  std::printf("shadow %.2f levels deep, %.2f off, key up to %.0f\n", depth / values, off / values,
              deepest);
  EXPECT_EQ(brightest, 0);
  EXPECT_GT(deepest, 60.0);
  EXPECT_LT(off, 0.35 * depth);
}

// The subject's image in a mirror is there, and fades as it does over the scene's picture.
TEST_P(FillTest, MirrorImagesAreInTheKey) {
  const auto renderer = make_renderer();
  RenderSettings settings = all_layers();
  settings.shadow = ShadowQuality::off;
  for (const MirrorMode mode : {MirrorMode::fresnel, MirrorMode::plain}) {
    settings.mirror = mode;
    // What a transparent pixel's colour is says nothing.
    const Picture made = composite_over(*renderer, {0, 0, 0, 0}, settings);
    const Picture white = composite_over(*renderer, {255, 255, 255, 0}, settings);
    const Picture without = composite_over(*renderer, {0, 0, 0, 0}, subject_alone());
    stage().trace_background(4, 2);
    const Picture plain = stage().background, direct = stage().composite(*renderer, settings);
    int values = 0;
    double change = 0.0, off = 0.0;
    for (std::size_t i = 0; i < made.pixels.size(); ++i) {
      if (i % 4 == 3 || without.pixels[i | 3] > 0 || made.pixels[i | 3] == 0) continue;
      ++values;
      EXPECT_EQ(made.pixels[i], white.pixels[i]);
      change += std::abs(plain.pixels[i] - direct.pixels[i]);
      off += std::abs(keyed(made, i, plain.pixels[i], settings.alpha) - direct.pixels[i]);
    }
    ASSERT_GT(values, 300);
    std::printf("image: change %.2f levels, %.2f off\n", change / values, off / values);
    EXPECT_LT(off, 0.5 * change) << static_cast<int>(mode);
  }
}

// The share that the shadow takes is of the light of the lamp that throws it, whichever it is.
TEST_P(FillTest, TheMainLampCountsBehindOthers) {
  const auto drawn = [&] {
    const auto renderer = make_renderer();
    return composite_over(*renderer, {0, 0, 0, 0}, all_layers());
  };
  const std::vector<Light> lights = stage().frame.lights;
  const Picture alone = drawn();
  Light dark = lights.at(0);
  dark.radiance = Vec3f(0.0f);
  stage().frame.lights.insert(stage().frame.lights.begin(), 40, dark);
  const Picture behind = drawn();
  stage().frame.lights = lights;
  EXPECT_TRUE(behind.pixels == alone.pixels);
}

TEST_P(FillTest, BackendsAgree) {
  if (processor()) GTEST_SKIP() << "the others are held against it";
  const auto own = make_renderer();
  ProcessorRenderer reference;
  const Picture a = composite_over(*own, {0, 0, 0, 0}, all_layers());
  const Picture b = composite_over(reference, {0, 0, 0, 0}, all_layers());
  double squares = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    if (i % 4 != 3)
      squares += std::pow(
          keyed(a, i, 90, AlphaCoding::straight) - keyed(b, i, 90, AlphaCoding::straight), 2);
  const double rms = std::sqrt(squares / (0.75 * static_cast<double>(a.pixels.size())));
  std::printf("backends differ by %.2f levels (rms)\n", rms);
  EXPECT_LT(rms, 2.0);
}

INSTANTIATE_TEST_SUITE_P(Backends, FillTest, ::testing::ValuesIn(testing::all_backends),
                         testing::backend_name);

// What a pixel's fill is, in numbers.
TEST(Fill, APixel) {
  const auto grey = [](std::uint32_t v) { return 0xff000000u | v << 16 | v << 8 | v; };
  FillPixel pixel;
  for (int k = 0; k < 3; ++k) {
    pixel.over[k] = over_grey(0x00123456u, fill_greys[k], AlphaCoding::straight);
    EXPECT_EQ(pixel.over[k], grey(static_cast<std::uint32_t>(fill_greys[k])));
    // A shadow that leaves three quarters of each code.
    pixel.ground[k] = grey(static_cast<std::uint32_t>(3 * fill_greys[k] / 4));
  }
  pixel.background = 0x00123456u;
  pixel.whole = pixel.ground[1];
  EXPECT_EQ(fill_of(pixel, AlphaCoding::straight), 0x40000000u);
  // Nothing done to it: the background stays, whatever it is.
  for (int k = 0; k < 3; ++k) pixel.ground[k] = pixel.over[k];
  pixel.whole = pixel.over[1];
  EXPECT_EQ(fill_of(pixel, AlphaCoding::straight), 0x00123456u);
  // A subject of the middle's colour differs nowhere, but has its coverage.
  pixel.coverage = 0.5f;
  pixel.colour = Vec3f(128.0f / 255.0f);
  EXPECT_EQ(fill_of(pixel, AlphaCoding::straight), 0x80808080u);
  EXPECT_EQ(fill_of(pixel, AlphaCoding::premultiplied), 0x80404040u);
  // All of it.
  pixel.coverage = 1.0f;
  pixel.whole = 0xff0a141eu;
  EXPECT_EQ(fill_of(pixel, AlphaCoding::straight), 0xff0a141eu);
}

}  // namespace
}  // namespace polyhull
