// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames as RGBA, against double precision, and every instruction set against the plain one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "base/instruction_set.h"
#include "silhouette/pixels/choose_kernels.h"
#include "silhouette/pixels/colour_kernels.h"
#include "silhouette/pixels/kernels.h"

namespace polyhull {
namespace {

constexpr std::array yuv_formats = {FrameFormat::i420, FrameFormat::nv12,      FrameFormat::yuy2,
                                    FrameFormat::uyvy, FrameFormat::i420_10le, FrameFormat::v210};

struct Stored {
  FrameView view;
  std::vector<std::uint8_t> bytes[3];
};

/// Random samples in a frame of the format, rows longer than they need be.
Stored random_frame(FrameFormat format, int width, int height, unsigned seed) {
  Stored s;
  s.view.format = format;
  s.view.width = width;
  s.view.height = height;
  const int chroma = (width + 1) / 2;
  const bool planar = format == FrameFormat::i420 || format == FrameFormat::i420_10le;
  const int unit = format == FrameFormat::i420_10le ? 2 : 1;
  const bool packed = is_422(format);
  const int bytes = format == FrameFormat::v210 ? (width + 5) / 6 * 16 : chroma * 4;
  const int rows[3] = {height, packed ? 0 : (height + 1) / 2, planar ? (height + 1) / 2 : 0};
  const int strides[3] = {packed ? bytes + 5 : width * unit + 3,
                          planar ? chroma * unit + 7 : chroma * 2 + 1, chroma * unit + 9};
  std::mt19937 random(seed);
  for (int i = 0; i < 3; ++i) {
    s.bytes[i].resize(static_cast<std::size_t>(strides[i]) * rows[i]);
    for (std::uint8_t& b : s.bytes[i]) b = static_cast<std::uint8_t>(random());
    s.view.planes[i] = s.bytes[i].data();
    s.view.strides[i] = strides[i];
  }
  return s;
}

double sample(const FrameView& f, int plane, int row, int i, int step, int offset) {
  const std::uint8_t* p = f.row(plane, row);
  if (f.format == FrameFormat::v210) {  // Cb, Y, Cr, Y in UYVY's order, ten bits each
    const int bit = (i * step + offset) / 3 * 32 + (i * step + offset) % 3 * 10;
    int value = 0;
    for (int k = 0; k < 10; ++k) value |= (p[(bit + k) / 8] >> (bit + k) % 8 & 1) << k;
    return value;
  }
  if (f.format == FrameFormat::i420_10le) return p[2 * i] + 256 * (p[2 * i + 1] & 3);
  return p[i * step + offset];
}

/// Chroma at the luma sample (x, y), bilinear between the samples by where the site has them.
double chroma_at(const FrameView& f, int which, int x, int y) {
  const bool packed = is_422(f.format);
  const auto stored = [&](int i, int j) {
    i = std::clamp(i, 0, (f.width + 1) / 2 - 1);
    if (packed) {
      return sample(f, 0, j, i, 4, (f.format == FrameFormat::yuy2 ? 1 : 0) + 2 * which);
    }
    j = std::clamp(j, 0, (f.height + 1) / 2 - 1);
    if (f.format == FrameFormat::nv12) return sample(f, 1, j, i, 2, which);
    return sample(f, 1 + which, j, i, 1, 0);
  };
  const bool beside = f.site == ChromaSite::centre || f.site == ChromaSite::top;
  const bool below = f.site == ChromaSite::centre || f.site == ChromaSite::left;
  const double u = beside ? (x - 0.5) / 2 : x / 2.0;
  const double v = packed ? y : below ? (y - 0.5) / 2 : y / 2.0;
  const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
  const double s = u - i, t = v - j;
  const double top = (1 - s) * stored(i, j) + s * stored(i + 1, j);
  if (t == 0.0) return top;
  return (1 - t) * top + t * ((1 - s) * stored(i, j + 1) + s * stored(i + 1, j + 1));
}

void exact_pixel(const FrameView& f, int x, int y, double rgb[3]) {
  double kr = 0.299, kb = 0.114;
  if (f.matrix == ColourMatrix::bt709) kr = 0.2126, kb = 0.0722;
  if (f.matrix == ColourMatrix::bt2020) kr = 0.2627, kb = 0.0593;
  const double unit = is_ten_bit(f.format) ? 4.0 : 1.0;
  const double largest = is_ten_bit(f.format) ? 1023.0 : 255.0;
  const int step = is_422(f.format) ? 2 : 1;
  const int offset = f.format == FrameFormat::uyvy || f.format == FrameFormat::v210 ? 1 : 0;
  const double stored = sample(f, 0, y, x, step, offset);
  const double luma = f.full_range ? stored / largest : (stored / unit - 16) / 219;
  const double range = f.full_range ? largest : 224 * unit;
  const double cb = (chroma_at(f, 0, x, y) - 128 * unit) / range;
  const double cr = (chroma_at(f, 1, x, y) - 128 * unit) / range;
  rgb[0] = luma + 2 * (1 - kr) * cr;
  rgb[2] = luma + 2 * (1 - kb) * cb;
  rgb[1] = (luma - kr * rgb[0] - kb * rgb[2]) / (1 - kr - kb);
  for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(rgb[c] * 255, 0.0, 255.0);
}

std::vector<const silhouette::ColourKernels*> variants() {
  std::vector<const silhouette::ColourKernels*> all{&silhouette::ColourKernels::baseline()};
#if defined(__x86_64__)
  if (has_avx2()) all.push_back(&silhouette::ColourKernels::avx2());
#endif
  return all;
}

/// Planar 4:4:4, planar 4:2:2 of ten bits, packed 4:2:2 (YVYU), two planes of 4:2:0 with twelve bits
/// high in their words, planar RGB.
std::vector<Stored> described_frames(int width, int height) {
  const SampleLayout layouts[] = {
      {{{{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}}},
      {{{{0, 0, 2}, {1, 0, 2}, {2, 0, 2}}}, false, 10, 0, true},
      {{{{0, 0, 2}, {0, 3, 4}, {0, 1, 4}}}, false, 8, 0, true},
      {{{{0, 0, 2}, {1, 0, 4}, {1, 2, 4}}}, false, 12, 4, true, true},
      {{{{2, 0, 1}, {0, 0, 1}, {1, 0, 1}}}, true},
  };
  std::vector<Stored> frames;
  for (const SampleLayout& layout : layouts) {
    Stored& s = frames.emplace_back();
    s.view.format = FrameFormat::described;
    s.view.samples = layout;
    s.view.width = width;
    s.view.height = height;
    std::mt19937 random(static_cast<unsigned>(width));
    for (int i = 0; i < 3; ++i) {
      s.bytes[i].resize(static_cast<std::size_t>(4 * width + 4) * height);
      for (std::uint8_t& b : s.bytes[i]) b = static_cast<std::uint8_t>(random());
      s.view.planes[i] = s.bytes[i].data();
      s.view.strides[i] = 4 * width + 4;
    }
  }
  return frames;
}

TEST(Colour, DescribedFramesAreTheSameInPartsAndCopied) {
  for (const int width : {1, 2, 5, 64, 517})
    for (const Stored& s : described_frames(width, 6)) {
      check_frame(s.view);
      const int x0 = width / 3, x1 = width - width / 5, y0 = 1, y1 = 5;
      FrameCopy copy;
      copy.assign(s.view, {x0, y0, x1 - x0, y1 - y0});
      EXPECT_TRUE(same_pixels(s.view, copy.view(), {x0, y0, x1 - x0, y1 - y0}));
      for (int y = y0; y < y1; ++y) {
        std::vector<std::uint8_t> whole(4u * width), part(4u * width), copied(4u * width);
        convert_row(s.view, y, 0, width, whole.data());
        convert_row(s.view, y, x0, x1, part.data());
        convert_row(copy.view(), y, x0, x1, copied.data());
        const std::size_t bytes = 4u * (x1 - x0);
        EXPECT_EQ(std::memcmp(part.data(), &whole[4u * x0], bytes), 0) << width << " " << y;
        EXPECT_EQ(std::memcmp(copied.data(), part.data(), bytes), 0) << width << " " << y;
        if (s.view.samples.rgb) continue;
        for (const silhouette::ColourKernels* kernels : variants()) {
          kernels->convert_yuv(s.view, y, 0, width, part.data());
          EXPECT_EQ(part, whole) << width << " " << y;
        }
      }
    }
}

TEST(Colour, FramesBecomeRgbWithinALevelOfTheExactColour) {
  for (const FrameFormat format : yuv_formats) {
    for (const ChromaSite site :
         {ChromaSite::left, ChromaSite::centre, ChromaSite::top_left, ChromaSite::top}) {
      for (const int width : {1, 2, 3, 8, 37, 513}) {
        Stored s = random_frame(format, width, 5, static_cast<unsigned>(width));
        s.view.site = site;
        s.view.full_range = width % 2 == 0;
        s.view.matrix = width == 37  ? ColourMatrix::bt601
                        : width == 3 ? ColourMatrix::bt2020
                                     : ColourMatrix::bt709;
        std::vector<std::uint8_t> row(static_cast<std::size_t>(width) * 4);
        for (int y = 0; y < 5; ++y) {
          convert_row(s.view, y, 0, width, row.data());
          for (int x = 0; x < width; ++x) {
            double rgb[3];
            exact_pixel(s.view, x, y, rgb);
            for (int c = 0; c < 3; ++c) {
              ASSERT_NEAR(row[4 * x + c], rgb[c], 1.0)
                  << name_of(format) << " site " << int(site) << " " << width << " at " << x << ","
                  << y << " channel " << c;
            }
            ASSERT_EQ(row[4 * x + 3], 255);
          }
        }
      }
    }
  }
}

TEST(Colour, PartsOfARowAndInstructionSetsGiveTheSameBytes) {
  for (const FrameFormat format : yuv_formats) {
    constexpr int width = 701;
    Stored s = random_frame(format, width, 4, 11);
    s.view.site = ChromaSite::centre;
    std::vector<std::uint8_t> whole(width * 4);
    silhouette::ColourKernels::baseline().convert_yuv(s.view, 1, 0, width, whole.data());
    for (const silhouette::ColourKernels* kernels : variants()) {
      for (const auto& [x0, x1] : {std::pair{0, width},
                                   {1, 2},
                                   {1, 640},
                                   {255, 258},
                                   {256, 701},
                                   {257, 700},
                                   {699, 701},
                                   {700, 701},
                                   {40, 40}}) {
        std::vector<std::uint8_t> part((x1 - x0) * 4 + 1, 77);
        kernels->convert_yuv(s.view, 1, x0, x1, part.data());
        ASSERT_TRUE(std::equal(part.begin(), part.end() - 1, whole.begin() + x0 * 4))
            << name_of(format) << " " << x0 << " to " << x1;
        ASSERT_EQ(part.back(), 77) << "written beyond the end";
      }
    }
  }
}

TEST(Colour, CompositeTakesSpillAwayAndPutsAlphaIn) {
  std::mt19937 random(3);
  constexpr int count = 777;
  std::vector<std::uint8_t> pixels(count * 4), alpha(count);
  for (std::uint8_t& b : pixels) b = static_cast<std::uint8_t>(random());
  for (std::uint8_t& b : alpha) b = static_cast<std::uint8_t>(random());
  std::vector<std::int16_t> weights(count);  // those of edges and of solid parts, too
  for (std::int16_t& w : weights)
    w = static_cast<std::int16_t>(std::clamp(static_cast<int>(random() % 98304) - 32768, 0, 32767));
  for (const silhouette::ColourKernels* kernels : variants()) {
    for (const bool swap : {false, true}) {
      for (const std::int16_t take : {0, 350}) {  // of 512: a level of the signal has 64 units
        const silhouette::DespillForms green{{-64, 64, 0}, {0, 64, -64}, {0, take, 0}, 20 * 64};
        std::vector<std::uint8_t> out(count * 4);
        kernels->composite(pixels.data(), count, swap, green, weights.data(), alpha.data(),
                           out.data());
        for (int i = 0; i < count; ++i) {
          const int r = pixels[4 * i + (swap ? 2 : 0)], g = pixels[4 * i + 1];
          const int b = pixels[4 * i + (swap ? 0 : 2)];
          const double whole = std::max(std::min(g - r, g - b), 0);
          const double spill =
              std::min(whole, 20.0 + std::max(whole - 20.0, 0.0) * weights[i] / 32768.0);
          ASSERT_EQ(out[4 * i], r);
          ASSERT_NEAR(out[4 * i + 1], std::max(g - spill * take / 512.0, 0.0), 0.51);
          ASSERT_EQ(out[4 * i + 2], b);
          ASSERT_EQ(out[4 * i + 3], alpha[i]);
        }
        // In place.
        std::vector<std::uint8_t> same = pixels;
        kernels->composite(same.data(), count, swap, green, weights.data(), alpha.data(),
                           same.data());
        ASSERT_EQ(same, out);
      }
    }
  }
}

TEST(ChooseKernels, SaysWhatPolyhullIsaTakes) {
  const std::string best = silhouette::choose_kernels(nullptr).kernels.name;
  EXPECT_EQ(silhouette::choose_kernels("plain").kernels.name, std::string("plain"));
  for (const char* quiet : {static_cast<const char*>(nullptr), "", "plain"})
    EXPECT_EQ(silhouette::choose_kernels(quiet).complaint, "");
  for (const char* name : {"v3", "PLAIN", "none"}) {
    const silhouette::KernelChoice choice = silhouette::choose_kernels(name);
    EXPECT_EQ(choice.kernels.name, best);
    for (const std::string& word : {std::string(name), std::string("POLYHULL_ISA"),
                                    std::string("plain, baseline, avx2 or avx512")})
      EXPECT_NE(choice.complaint.find(word), std::string::npos) << choice.complaint;
  }
#if defined(__x86_64__)
  // A set that the machine lacks is said.
  for (const auto& [name, set, there] : {std::tuple("baseline", "baseline", true),
                                         {"avx2", "avx2", has_avx2()},
                                         {"avx512", "avx512", has_avx512()}}) {
    const silhouette::KernelChoice choice = silhouette::choose_kernels(name);
    EXPECT_EQ(choice.kernels.name, there ? std::string(set) : best);
    EXPECT_EQ(choice.complaint.find("this machine does not have") != std::string::npos, !there);
    EXPECT_EQ(choice.complaint.empty(), there) << choice.complaint;
  }
#endif
}

}  // namespace
}  // namespace polyhull
