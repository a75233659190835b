// SPDX-License-Identifier: LGPL-2.1-or-later
// No memory is taken per frame once the sizes have been seen.
#include <gtest/gtest.h>

#include <cmath>

#include "silhouette/silhouette.h"
#include "silhouette_frames.h"
#include "support/malloc_counter.h"

namespace polyhull {
namespace {

using test::Colour;

long allocations(const std::function<void()>& work) {
  return test::count_mallocs(work).taken;
}

// A figure with limbs, a hole and specks, at another place in each picture.
test::Frame figure(FrameFormat format, int t) {
  constexpr int width = 160, height = 120;
  constexpr Colour screen{60, 190, 70}, subject{150, 110, 160};
  return test::make_frame(format, width, height, [&](int x, int y) {
    const double u = (x - 80.0 - 3.0 * t) / height, v = (y - 60.0) / height;
    const double a = std::atan2(v, u), r = std::hypot(u, v);
    double d = 0.3 * (1.0 + 0.3 * std::sin(5.0 * a + t)) - r;
    d = std::min(d, std::hypot(u - 0.1, v) - 0.05);
    d = std::max(d, 0.04 - std::hypot(u - 0.5, v - 0.4));
    const double cover = std::clamp(0.5 + d * height * 0.7, 0.0, 1.0);
    const double grain = (x * 7 + y * 13 + t * 5) % 5 - 2.0;
    Colour c;
    for (int i = 0; i < 3; ++i) c[i] = screen[i] + (subject[i] - screen[i]) * cover + grain;
    return c;
  });
}

TEST(Allocation, IsCounted) {
  // The counter sees what it must see.
  volatile int* kept = nullptr;
  EXPECT_GE(allocations([&] { kept = new int(3); }), 1);
  delete kept;
  std::vector<int> numbers;
  EXPECT_GE(allocations([&] { numbers.resize(1000); }), 1);
  EXPECT_EQ(allocations([&] { numbers.resize(10); }), 0);
  Silhouetter silhouetter;
  silhouetter.set({});
  const test::Frame frame = figure(FrameFormat::bgrx, 0);
  EXPECT_GT(allocations([&] { silhouetter.process(frame.view); }), 10) << "the first frame's";
}

TEST(Allocation, NonePerFrameInOnePass) {
  std::vector<SilhouetteSettings> variants(9);
  variants[1].blur.sigma = 0.0;
  variants[2].blur.sigma = 30.0;
  variants[3].blur.method = BlurMethod::box;
  variants[4].blur.method = BlurMethod::recursive;
  variants[5].key.choke = 1.5;
  variants[5].key.close = 2.0;
  variants[6].method = TraceMethod::binary;
  variants[7].key.method = KeyMethod::threshold;
  variants[8].key.clip_black = 0.0;
  for (const FrameFormat format : test::all_formats) {
    std::vector<test::Frame> frames;
    for (int t = 0; t < 3; ++t) frames.push_back(figure(format, t));
    for (std::size_t i = 0; i < variants.size(); ++i) {
      Silhouetter silhouetter;
      silhouetter.set(variants[i]);
      std::vector<std::uint8_t> pixels(4 * 160 * 120);
      const auto round = [&] {
        for (const test::Frame& frame : frames) {
          const Rings& rings = silhouetter.process(frame.view);
          const Rectangle box = bounding_rectangle(rings, 160, 120);
          silhouetter.write_rgba(frame.view, box, pixels.data(), 4 * box.width);
        }
        // Once more the last: the way of unchanged pictures.
        for (int k = 0; k < 4; ++k) silhouetter.process(frames.back().view);
      };
      round();
      EXPECT_EQ(allocations(round), 0) << "variant " << i << " " << name_of(format);
      // What adaptive does.
      variants[i].approximate.tolerance = 2.0;
      silhouetter.set(variants[i]);
      EXPECT_EQ(allocations(round), 0) << "variant " << i << ", another tolerance";
      EXPECT_FALSE(silhouetter.process(frames[0].view).empty());
    }
  }
}

TEST(Allocation, NonePerFrameInTheStages) {
  for (const BlurMethod method : {BlurMethod::fir, BlurMethod::box, BlurMethod::recursive}) {
    std::vector<test::Frame> frames;
    for (int t = 0; t < 6; ++t) frames.push_back(figure(FrameFormat::nv12, t));
    Keyer keyer;
    Blur blur;
    blur.set({method, 2.0, 3, 0});
    Tracer tracer;
    Approximator approximator;
    Matte matte;
    Field field;
    Rings traced, rings;
    std::vector<std::int32_t> parents;
    const auto round = [&] {
      for (const test::Frame& frame : frames) {
        keyer.key(frame.view, matte);
        blur.apply(matte, field);
        tracer.trace(field, {TraceMethod::subpixel, 2.0}, traced, &parents);
        approximator.approximate(traced, parents, {}, rings);
      }
    };
    round();
    EXPECT_EQ(allocations(round), 0) << static_cast<int>(method);
    EXPECT_FALSE(rings.empty());
  }
}

}  // namespace
}  // namespace polyhull
