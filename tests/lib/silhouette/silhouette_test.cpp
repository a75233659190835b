// SPDX-License-Identifier: LGPL-2.1-or-later
#include "silhouette/silhouette.h"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "base/instruction_set.h"
#include "silhouette/pixels/kernels.h"
#include "silhouette_checks.h"
#include "silhouette_frames.h"

namespace polyhull {
namespace {

using test::Colour;

Colour mix(const Colour& a, const Colour& b, double t) {
  return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

constexpr Colour screen{60, 190, 70}, subject{150, 110, 160};

// A figure with limbs and holes, `t` moves it.
test::Frame figure(FrameFormat format, int width, int height, double t, double noise = 0.0) {
  std::mt19937 random(static_cast<unsigned>(t * 1000));
  std::normal_distribution<double> normal(0.0, noise > 0.0 ? noise : 1.0);
  const double size = std::min(width, height);
  return test::make_frame(format, width, height, [&](int x, int y) {
    const double u = (x - 0.5 * width - 7.0 * t) / size, v = (y - 0.5 * height) / size;
    const double a = std::atan2(v, u), r = std::hypot(u, v);
    double d = 0.3 * (1.0 + 0.3 * std::sin(5.0 * a + t)) - r;
    d = std::min(d, std::hypot(u - 0.1, v) - 0.05);
    Colour c = mix(screen, subject, std::clamp(0.5 + d * size * 0.7, 0.0, 1.0));
    if (noise > 0.0)
      for (double& level : c) level += normal(random);
    return c;
  });
}

Rings staged(const SilhouetteSettings& s, const FrameView& frame) {
  Keyer keyer;
  keyer.set(s.key);
  Matte matte;
  keyer.key(frame, matte);
  Blur blur;
  blur.set(s.blur);
  Field field;
  blur.apply(matte, field);
  Contourer contourer;
  const TraceSettings trace{s.method, corrected_sigma(s.blur, s.correct_curvature)};
  const Rings rings = contourer.find(field, {trace, s.approximate});
  return rings;
}

TEST(Silhouette, OnePassEqualsTheStages) {
  std::vector<SilhouetteSettings> variants(12);
  variants[1].blur.sigma = 0.0;
  variants[2].blur.sigma = 5.3;
  variants[3].blur.method = BlurMethod::box;
  variants[4].blur.method = BlurMethod::recursive;
  variants[5].blur.threshold = 128;
  variants[6].key.choke = 1.5;
  variants[7].method = TraceMethod::binary;
  variants[8].key.roi = {13, 9, 140, 77};
  variants[9].key.method = KeyMethod::threshold;
  variants[10].key.clip_black = 0.0;
  variants[11].approximate.tolerance = 0.0;
  for (std::size_t i = 0; i < variants.size(); ++i)
    for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::nv12, FrameFormat::yuy2}) {
      const test::Frame frame = figure(format, 211, 133, 1.0, 2.0);
      Silhouetter silhouetter;
      silhouetter.set(variants[i]);
      const Rings want = staged(variants[i], frame.view);
      for (int repeat = 0; repeat < 2; ++repeat) {
        const Rings& got = silhouetter.process(frame.view);
        EXPECT_EQ(got, want) << "variant " << i << " " << name_of(format);
        EXPECT_FALSE(got.empty());
        EXPECT_TRUE(test::simple_and_disjoint(got));
      }
      // The pixels: the keyer's colours with its matte.
      Keyer keyer;
      keyer.set(variants[i].key);
      Matte keyed;
      keyer.key(frame.view, keyed);
      const Rectangle box = bounding_rectangle(want, 211, 133);
      std::vector<std::uint8_t> a(4 * static_cast<std::size_t>(box.width) * box.height), b = a;
      keyer.write_rgba(frame.view, keyed, box, KeyView::composite, a.data(), 4 * box.width);
      silhouetter.write_rgba(frame.view, box, b.data(), 4 * box.width);
      EXPECT_EQ(a, b) << "variant " << i;
    }
}

TEST(Silhouette, SameBytesOnManyThreads) {
  const test::Frame frame = figure(FrameFormat::nv12, 320, 200, 0.4, 3.0);
  const Rings want = staged({}, frame.view);
  std::vector<Rings> got(4);
  std::vector<std::thread> threads;
  for (auto& rings : got)
    threads.emplace_back([&] {
      Silhouetter silhouetter;
      silhouetter.set({});
      for (int i = 0; i < 3; ++i) rings = silhouetter.process(frame.view);
    });
  for (auto& t : threads) t.join();
  for (const Rings& rings : got) EXPECT_EQ(rings, want);
}

TEST(Silhouette, EqualFramesKeepTheirContours) {
  for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::i420, FrameFormat::uyvy}) {
    test::Frame frame = figure(format, 200, 150, 0.0);
    Silhouetter with, without;
    SilhouetteSettings settings;
    settings.key.roi = {20, 20, 150, 110};
    with.set(settings);
    settings.reuse = false;
    without.set(settings);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(with.process(frame.view), without.process(frame.view));
    EXPECT_EQ(with.stats().reused, 2u) << "from the fourth on";
    EXPECT_EQ(without.stats().reused, 0u);
    // A change outside the region of interest changes nothing, one inside everything.
    frame.planes[0][3] ^= 0x40;
    with.process(frame.view);
    EXPECT_EQ(with.stats().reused, 3u);
    const std::ptrdiff_t inside = frame.view.strides[0] * 71 + (format == FrameFormat::bgrx   ? 4
                                                                : format == FrameFormat::uyvy ? 2
                                                                                              : 1) *
                                                                   60;
    frame.planes[0][inside] ^= 0x40;
    EXPECT_EQ(with.process(frame.view), without.process(frame.view));
    EXPECT_EQ(with.stats().reused, 3u);
    // So do new settings.
    settings.reuse = true;
    settings.approximate.tolerance = 3.0;
    with.set(settings);
    for (int i = 0; i < 3; ++i) with.process(frame.view);
    without.set(settings);
    EXPECT_EQ(with.process(frame.view), without.process(frame.view));
    // And other colours of the same bytes.
    if (is_yuv(format)) {
      frame.view.matrix = ColourMatrix::bt2020;
      EXPECT_EQ(with.process(frame.view), without.process(frame.view));
    }
    // And another picture.
    frame = figure(format, 200, 150, 1.0);
    EXPECT_EQ(with.process(frame.view), without.process(frame.view));
    settings.approximate.tolerance = 1.0;
    with.set(settings);
    without.set(settings);
    EXPECT_EQ(with.process(frame.view), without.process(frame.view));
  }
}

// Contour error of an ellipse keyed from noisy 4:2:0.
TEST(Silhouette, NoisyChromaSubsampledKeying) {
  const double a = 260.0, b = 190.0, cx = 320.3, cy = 239.8;
  // Cloth: two slow waves of 12 levels each over a skin tone, more in red than elsewhere.
  struct Case {
    double noise, texture;
    bool given;  // the prevailing colour, as foreground
    double bound;
  };
  const Case cases[] = {{0.0, 0.0, false, 0.03},
                        {4.0, 0.0, false, 0.032},
                        {4.0, 12.0, false, 0.045},
                        {4.0, 12.0, true, 0.045}};
  std::printf("%-6s %6s %8s %6s %10s %10s\n", "format", "noise", "texture", "given", "mean abs",
              "bias");
  for (const FrameFormat format : {FrameFormat::bgrx, FrameFormat::nv12})
    for (const auto& [noise, texture, given, bound] : cases) {
      const Colour cloth{190, 95, 80};
      std::mt19937 random(9);
      std::normal_distribution<double> normal(0.0, std::max(noise, 1e-9));
      const test::Frame frame = test::make_frame(format, 640, 480, [&](int x, int y) {
        const double inside =
            test::coverage(x, y,
                           [&](double u, double v) {
                             return (u - cx) * (u - cx) / (a * a) + (v - cy) * (v - cy) / (b * b) <
                                    1.0;
                           }) /
            255.0;
        const double wave = texture * (std::sin(x * 0.05) + 0.8 * std::cos(y * 0.07));
        const Colour front =
            texture > 0.0 ? Colour{cloth[0] + wave, cloth[1] + 0.5 * wave, cloth[2] + 0.5 * wave}
                          : subject;
        Colour c = mix(screen, front, inside);
        for (double& level : c) level += normal(random);
        return c;
      });
      SilhouetteSettings settings;
      settings.approximate.tolerance = 0.0;
      settings.approximate.min_area = 1000.0;
      if (given) settings.key.foreground = Rgb{190, 95, 80};
      Silhouetter silhouetter;
      silhouetter.set(settings);
      const Rings& rings = silhouetter.process(frame.view);
      ASSERT_EQ(rings.size(), 1u);
      double absolute = 0.0, bias = 0.0;
      for (const Vec2f p : rings.points) {
        // First-order distance to the ellipse.
        const double u = (p.x - cx) / a, v = (p.y - cy) / b;
        const double f = u * u + v * v - 1.0, g = 2.0 * std::hypot(u / a, v / b);
        absolute += std::abs(f / g);
        bias += f / g;
      }
      absolute /= static_cast<double>(rings.points.size());
      bias /= static_cast<double>(rings.points.size());
      std::printf("%-6s %6g %8g %6s %10.4f %+10.4f\n", name_of(format), noise, texture,
                  given ? "yes" : "", absolute, bias);
      EXPECT_LE(absolute, bound);
      EXPECT_LE(std::abs(bias), 0.02);
    }
}

TEST(Silhouette, SizesFromOnePixelOn) {
  for (const auto& [w, h] :
       {std::pair{1, 1}, {1, 40}, {40, 1}, {2, 2}, {16, 16}, {17, 3}, {64, 65}, {129, 31}})
    for (const double sigma : {0.0, 2.0, 30.0}) {
      SilhouetteSettings settings;
      settings.blur.sigma = sigma;
      settings.key.screen = Rgb{60, 190, 70};
      settings.key.foreground = Rgb{150, 110, 160};
      settings.approximate.min_area = 0.0;
      settings.approximate.min_edges = 3;
      settings.approximate.tolerance = 0.1;  // narrower frames than 1 px may vanish within 1 px
      Silhouetter silhouetter;
      silhouetter.set(settings);
      const test::Frame empty =
          test::make_frame(FrameFormat::nv12, w, h, [](int, int) { return screen; });
      EXPECT_TRUE(silhouetter.process(empty.view).empty());
      const test::Frame full =
          test::make_frame(FrameFormat::bgrx, w, h, [](int, int) { return subject; });
      const Rings& rings = silhouetter.process(full.view);
      ASSERT_EQ(rings.size(), 1u) << w << "x" << h;
      EXPECT_NEAR(test::total_area(rings), w * h, 0.1 * 2 * (w + h));
    }
}

TEST(Silhouette, NoiseAndManyComponents) {
  std::mt19937 random(4);
  const test::Frame noise = test::make_frame(
      FrameFormat::rgbx, 300, 200, [&](int, int) { return random() % 2 ? screen : subject; });
  const test::Frame dots = test::make_frame(FrameFormat::rgbx, 600, 600, [&](int x, int y) {
    return x % 6 < 3 && y % 6 < 3 ? subject : screen;
  });
  for (const double sigma : {0.0, 0.7})
    for (const double tolerance : {0.5, 2.0}) {
      SilhouetteSettings settings;
      settings.blur.sigma = sigma;
      settings.approximate.tolerance = tolerance;
      settings.approximate.min_area = 0.0;
      settings.approximate.min_edges = 3;
      settings.key.screen = Rgb{60, 190, 70};
      settings.key.foreground = Rgb{150, 110, 160};
      Silhouetter silhouetter;
      silhouetter.set(settings);
      const Rings a = silhouetter.process(noise.view);
      EXPECT_TRUE(test::simple_and_disjoint(a));
      EXPECT_EQ(a, staged(settings, noise.view));
      const Rings& b = silhouetter.process(dots.view);
      EXPECT_EQ(b.size(), 10000u);
      EXPECT_TRUE(test::simple_and_disjoint(b));
    }
}

TEST(Silhouette, BoundingRectangle) {
  Rings rings;
  rings.points = {{-0.5f, 2.f}, {3.2f, 2.6f}, {1.f, 7.5f}};
  rings.ends = {3};
  EXPECT_EQ(bounding_rectangle(rings, 100, 100), (Rectangle{0, 2, 4, 6}));
  EXPECT_TRUE(bounding_rectangle({}, 10, 10).empty());
}

// Numbers of cells: on both sides of what 16 bits hold of them eightfold.
std::vector<std::int16_t> random_cells(std::mt19937& random, std::size_t count) {
  std::vector<std::int16_t> cells(count);
  for (auto& cell : cells)
    cell = static_cast<std::int16_t>(static_cast<int>(random() % 12288) - 4096);
  return cells;
}

// Pixel k of the 2^shift from a cell's centre to the next has its centre (2 k + 1) / 2^(shift + 1) of the way.
TEST(Silhouette, CellsAreSpreadEvenly) {
  std::mt19937 random(7);
  constexpr int count = 40;
  const std::vector<std::int16_t> cells = random_cells(random, count + 1);
  for (int shift = 1; shift <= 4; ++shift) {
    std::vector<std::int16_t> out(count << shift);
    silhouette::kernels().spread_cells(cells.data(), count, shift, out.data());
    for (int i = 0; i < count << shift; ++i) {
      const int left = cells[i >> shift], k = i % (1 << shift);
      const double way = (2 * k + 1) / static_cast<double>(2 << shift);
      const double v = left + std::floor((cells[(i >> shift) + 1] - left) * way);
      ASSERT_EQ(out[i], std::min(8.0 * v, 32767.0)) << "shift " << shift << " pixel " << i;
    }
  }
}

// Cutting the slope's quotient misses by less than a (1 - a) 255 / 4096, at most 63.75 / 4096, cutting the
// whole's by 1 / 4096, and rounding by a half. Pixels of mixed blocks keep to what they are: empty, full or between.
TEST(Silhouette, MixedBlocksAreBent) {
  constexpr int blocks = 256 / matte_block;
  for (const silhouette::Bend bend : {silhouette::Bend{1200, -900}, {-2500, 700}, {4096, 4096}}) {
    for (const BlockState state : {block_mixed, block_full, block_empty}) {
      std::vector<std::uint8_t> alpha(256);
      std::iota(alpha.begin(), alpha.end(), std::uint8_t{0});
      const std::vector<BlockState> states(blocks, state);
      silhouette::kernels().bend_blocks(bend, blocks, alpha.data(), states.data());
      for (int i = 0; i < 256; ++i) {
        const double a = i / 255.0;
        double bent = 255 * (a + a * (1 - a) * (bend.constant + bend.slope * a) / 4096);
        bent = i == 0 || i == 255 ? i : std::clamp(bent, 1.0, 254.0);
        ASSERT_NEAR(alpha[i], state == block_mixed ? bent : i, 0.5 + 64.75 / 4096)
            << "constant " << bend.constant << " value " << i << " state " << int{state};
      }
    }
  }
}

#if defined(__x86_64__)
// Every instruction set gives the same bytes.
TEST(Silhouette, KernelsAgree) {
  using namespace silhouette;
  std::mt19937 random(6);
  std::vector<const Kernels*> others = {&baseline_kernels()};
  if (has_avx2()) others.push_back(&avx2_kernels());
  if (has_avx512()) others.push_back(&avx512_kernels());
  const Kernels& plain = plain_kernels();
  constexpr int n = 176;
  std::vector<std::uint8_t> pixels(8 * n + 64), plate(4 * n);
  for (int round = 0; round < 50; ++round) {
    const unsigned extremes = 1 + random() % 30;
    for (auto& p : pixels)
      p = random() % extremes == 0 ? static_cast<std::uint8_t>(random()) : (random() % 2 ? 255 : 0);
    for (auto& p : plate) p = static_cast<std::uint8_t>(random());
    PixelForms forms{};
    forms.a_offset = static_cast<std::int16_t>(static_cast<int>(random() % 8000) - 4000);
    forms.b_offset = static_cast<std::int16_t>(static_cast<int>(random() % 8000) - 4000);
    for (auto* w : {forms.a, forms.b})
      for (int i = 0; i < 3; ++i)
        w[i] = static_cast<std::int8_t>(static_cast<int>(random() % 129) - 64);
    const Ramp ramp = with_sure_signals({static_cast<std::int16_t>(random() % 16000),
                                         static_cast<std::int16_t>(random() % 32000),
                                         static_cast<std::uint8_t>(random() % 128),
                                         static_cast<std::uint8_t>(128 + random() % 128)});
    std::vector<std::int16_t> base(n), gain(n), values(3 * n + 256), signal(2 * n + 8);
    for (int i = 0; i < n; ++i)
      base[i] = static_cast<std::int16_t>(random()),
      gain[i] = static_cast<std::int16_t>(random() % 32768);
    for (auto& v : values) v = static_cast<std::int16_t>(random() % (field_full + 1));
    std::vector<std::int16_t> narrow = values;
    for (auto& v : narrow) v /= 2;
    for (auto& v : signal) v = static_cast<std::int16_t>(random());
    const int radius = 1 + static_cast<int>(random() % 12);
    std::vector<std::int16_t> weights(radius + 2, 0);
    for (int k = 0; k <= radius; ++k)
      weights[k] = static_cast<std::int16_t>(32768 / (2 * radius + 1));
    std::vector<const std::uint8_t*> rows;
    for (int k = 0; k <= 2 * radius; ++k) rows.push_back(pixels.data() + random() % 512);
    const std::int16_t chroma_weights[4] = {
        static_cast<std::int16_t>(random() % 20000),
        static_cast<std::int16_t>(-static_cast<int>(random() % 20000)),
        static_cast<std::int16_t>(random() % 9000), 77};
    const std::int32_t offsets[2] = {-12345, 4321};
    const DifferenceRamp difference{0.5f, 1.2f, 10.0f, 9.0f, 0.15f};
    const auto bent = [&] { return static_cast<std::int32_t>(random() % 8193) - 4096; };
    const Bend bend{bent(), bent()};
    const std::vector<std::int16_t> cells = random_cells(random, 23);

    struct Out {
      std::vector<std::uint8_t> alpha, states;
      std::vector<std::int16_t> values;
      std::vector<std::uint16_t> bits;
      std::vector<std::int32_t> corrected, places;
      std::vector<float> numbers;
      bool operator==(const Out&) const = default;
    };
    const std::uint64_t random_bits[] = {random() * 0x100000001ull, random() * 0x10001ull,
                                         random() * 0x100000001ull, random() * 0x1000001ull};
    const std::uint16_t blocks[] = {1, 2, 5, 7};
    std::vector<BlockState> block_states(1 + random() % 150);
    for (auto& state : block_states)
      state = std::array{block_full, block_empty, block_mixed}[random() % 3];
    const auto run = [&](const Kernels& k) {
      Out out;
      std::vector<std::uint8_t> alpha(n), states(n / matte_block);
      std::vector<std::int16_t> line(2 * n + 16);
      const auto keep = [&] {
        out.alpha.insert(out.alpha.end(), alpha.begin(), alpha.end());
        out.states.insert(out.states.end(), states.begin(), states.end());
        out.values.insert(out.values.end(), line.begin(), line.end());
      };
      k.pixel_alpha(pixels.data(), n, forms, ramp, alpha.data(), states.data());
      keep();
      k.pixel_signal(pixels.data(), n - 3, forms, line.data());
      keep();
      k.ramp_alpha(signal.data(), n, ramp, alpha.data(), states.data());
      keep();
      k.local_alpha(signal.data(), base.data(), gain.data(), ramp, n, alpha.data(), states.data());
      keep();
      k.chroma_signal(pixels.data(), pixels.data() + 400, 3, 1, n - 5, chroma_weights, offsets,
                      line.data());
      keep();
      k.double_left(signal.data(), n - 5, line.data());
      keep();
      k.doubled_alpha(signal.data(), n, ramp, alpha.data(), states.data());
      keep();
      k.screen_blocks(signal.data() + 1, n / matte_block - 1, -30000, states.data());
      keep();
      k.difference_alpha(pixels.data(), plate.data(), n, difference, alpha.data());
      keep();
      k.states(pixels.data(), n / matte_block, states.data());
      keep();
      std::copy_n(pixels.begin(), n, alpha.begin());
      k.bend_blocks(bend, n / matte_block, alpha.data(), states.data());
      keep();
      for (int shift = 1; shift <= 4; ++shift) {
        k.spread_cells(cells.data(), 22, shift, line.data());
        keep();
      }
      k.fir_vertical(rows.data(), radius, weights.data(), blocks, 4, line.data());
      keep();
      k.fir_horizontal(narrow.data() + 64, radius, weights.data(), blocks, 4, line.data());
      keep();
      out.bits.resize(block_states.size() + 1);
      out.bits.resize(static_cast<std::size_t>(k.mixed_blocks(
          block_states.data(), static_cast<int>(block_states.size()), out.bits.data())));
      const std::size_t mixed = out.bits.size();
      out.bits.resize(mixed + n / 16);
      out.corrected.resize(n);
      k.inside(values.data() + 64, values.data() + 80, values.data() + 96, 3, 900,
               static_cast<std::int16_t>(round % 2 ? 97 : 0), blocks, 4, out.corrected.data(),
               out.bits.data() + mixed);
      const std::vector<std::uint64_t> above{random_bits[0], random_bits[1] | 5, 0, ~0ull >> 9, 0};
      const std::vector<std::uint64_t> below{random_bits[2], ~0ull, 0, random_bits[3] >> 1, 0};
      std::vector<std::int32_t> lists(3 * 260);
      CellChanges changes{lists.data(), lists.data() + 260, lists.data() + 520, 0, 0, 0};
      k.find_changes(above.data(), below.data(), 4, changes);
      out.places.assign(changes.on_row, changes.on_row + changes.on_row_count);
      out.places.insert(out.places.end(), changes.between, changes.between + changes.between_count);
      out.places.insert(out.places.end(), changes.cells, changes.cells + changes.cells_count);
      std::vector<std::int32_t> first(40), second(40);
      for (int i = 0; i < 40; ++i) first[i] = values[i], second[i] = -1 - values[i + 60];
      std::vector<float> crossings(40);
      k.crossing_offsets(first.data(), second.data(), 37, crossings.data());
      std::vector<float> x(37), y(37);
      for (int i = 0; i < 37; ++i) x[i] = values[i] / 512.0f, y[i] = values[i + 40] / 512.0f;
      out.numbers = {k.line_deviation(x.data(), y.data(), 37, 0.6f, 0.8f, 3.0f),
                     k.edge_deviation(x.data(), y.data(), 37, 1.0f, 2.0f, 0.8f, -0.6f, 20.0f)};
      out.numbers.insert(out.numbers.end(), crossings.begin(), crossings.end());
      return out;
    };
    const Out want = run(plain);
    for (const Kernels* k : others) {
      const Out got = run(*k);
      EXPECT_EQ(got.alpha, want.alpha) << k->name << " round " << round;
      EXPECT_EQ(got.states, want.states) << k->name << " round " << round;
      EXPECT_EQ(got.values, want.values) << k->name << " round " << round;
      EXPECT_EQ(got.bits, want.bits) << k->name << " round " << round;
      EXPECT_EQ(got.corrected, want.corrected) << k->name << " round " << round;
      EXPECT_EQ(got.places, want.places) << k->name << " round " << round;
      EXPECT_EQ(got.numbers, want.numbers) << k->name << " round " << round;
      if (::testing::Test::HasFailure()) return;
    }
  }
}
#endif

}  // namespace
}  // namespace polyhull
