// SPDX-License-Identifier: LGPL-2.1-or-later
// Packed pixels: exact where they must be, near where they may be, and nothing from a damaged block.
#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "support/refusal.h"
#include "wire/coded_view.h"
#include "wire/coding_choice.h"
#include "wire_examples.h"

namespace polyhull {
namespace {

constexpr PixelCoding codings[] = {PixelCoding::lz4, PixelCoding::zstd, PixelCoding::jpeg};

/// A picture as a camera gives it: smooth, with noise, on a matte; rows \p stride bytes apart.
std::vector<std::uint8_t> picture(const PixelShape& shape, int stride, double noise = 2.0) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(stride) * shape.height, 0xEE);
  std::mt19937 random(static_cast<unsigned>(shape.width * 31 + shape.height));
  std::normal_distribution<double> grain(0.0, noise);
  for (int y = 0; y < shape.height; ++y)
    for (int x = 0; x < shape.width; ++x)
      for (int c = 0; c < shape.channels; ++c) {
        const double away = std::hypot(x - 0.5 * shape.width, y - 0.5 * shape.height);
        const bool matte = c == 3 || shape.channels == 1;
        const double value =
            matte ? 255.0 * (away < 0.4 * shape.width)
                  : 120 + 60 * std::sin(0.05 * x + c) + 40 * std::cos(0.07 * y) + grain(random);
        pixels[static_cast<std::size_t>(y) * stride + x * shape.channels + c] =
            static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
  return pixels;
}

std::vector<std::uint8_t> packed_rows(const std::vector<std::uint8_t>& pixels,
                                      const PixelShape& shape, int stride) {
  std::vector<std::uint8_t> rows;
  const auto width = static_cast<std::ptrdiff_t>(shape.width) * shape.channels;
  for (int y = 0; y < shape.height; ++y) {
    const auto row = pixels.begin() + static_cast<std::ptrdiff_t>(y) * stride;
    rows.insert(rows.end(), row, row + width);
  }
  return rows;
}

TEST(PixelCoding, WithoutLossNothingIsLost) {
  PixelEncoder encoder;
  PixelDecoder decoder;
  for (const PixelShape shape : {PixelShape{1, 1, 4},
                                 {1, 1, 1},
                                 {1, 9, 4},
                                 {7, 1, 1},
                                 {33, 21, 4},
                                 {640, 480, 4},
                                 {127, 65, 1}})
    for (const int gap : {0, 12})
      for (const double noise : {0.0, 2.0, 200.0})
        for (const PixelCoding coding : {PixelCoding::lz4, PixelCoding::zstd}) {
          const int stride = shape.width * shape.channels + gap;
          const auto pixels = picture(shape, stride, noise);
          const auto block = encoder.encode(coding, shape, pixels, stride);
          std::vector<std::uint8_t> back(shape.bytes(), 1);
          decoder.decode(coding, shape, block, back);
          EXPECT_EQ(back, packed_rows(pixels, shape, stride))
              << shape.width << "x" << shape.height << "x" << shape.channels;
        }
}

TEST(PixelCoding, JpegKeepsTheMatteAndIsNear) {
  PixelEncoder encoder;
  PixelDecoder decoder;
  for (const PixelShape shape : {PixelShape{1, 1, 4}, {17, 9, 4}, {640, 480, 4}}) {
    const int stride = 4 * shape.width + 8;
    const auto pixels = picture(shape, stride);
    double before = 0;
    for (const int quality : {50, 90, 98}) {
      const auto block = encoder.encode(PixelCoding::jpeg, shape, pixels, stride, quality);
      std::vector<std::uint8_t> back(shape.bytes());
      decoder.decode(PixelCoding::jpeg, shape, block, back);
      const auto truth = packed_rows(pixels, shape, stride);
      double squares = 0;
      for (std::size_t i = 0; i < truth.size(); ++i) {
        if (i % 4 == 3) {
          ASSERT_EQ(back[i], truth[i]);
        } else {
          squares += (back[i] - truth[i]) * (back[i] - truth[i]);
        }
      }
      const double rms = std::sqrt(squares / (0.75 * static_cast<double>(truth.size())));
      if (shape.width < 640) continue;
      std::printf("quality %d: %.1f %% of the bytes, %.2f levels rms\n", quality,
                  100.0 * static_cast<double>(block.size()) / static_cast<double>(truth.size()),
                  rms);
      EXPECT_LT(rms, quality == 50 ? 4.0 : 2.5);
      if (before > 0) {
        EXPECT_LT(rms, before);
      }
      before = rms;
    }
  }
}

TEST(PixelCoding, ACamerasPictureBecomesHalf) {
  PixelEncoder encoder;
  const PixelShape shape{640, 480, 4};
  const auto pixels = picture(shape, 4 * 640);
  const double raw = static_cast<double>(shape.bytes());
  EXPECT_LT(static_cast<double>(encoder.encode(PixelCoding::lz4, shape, pixels, 2560).size()),
            0.8 * raw);
  EXPECT_LT(static_cast<double>(encoder.encode(PixelCoding::zstd, shape, pixels, 2560).size()),
            0.5 * raw);
  EXPECT_LT(static_cast<double>(encoder.encode(PixelCoding::jpeg, shape, pixels, 2560).size()),
            0.25 * raw);
}

TEST(PixelCoding, DamagedBlocksAreRefusedOrHarmless) {
  PixelEncoder encoder;
  PixelDecoder decoder;
  const PixelShape shape{60, 40, 4};
  const auto pixels = picture(shape, 240);
  std::mt19937 random(9);
  for (const PixelCoding coding : codings) {
    const auto kept = encoder.encode(coding, shape, pixels, 240);
    const std::vector<std::uint8_t> block(kept.begin(), kept.end());
    std::vector<std::uint8_t> back(shape.bytes());
    for (std::size_t size = 0; size < block.size(); ++size)
      EXPECT_THROW(decoder.decode(coding, shape, std::span(block).first(size), back), Error)
          << size << " of " << block.size() << " by " << static_cast<int>(coding);
    int refused = 0;
    for (int round = 0; round < 3000; ++round) {
      std::vector<std::uint8_t> wrong = block;
      for (unsigned i = 0; i <= random() % 4; ++i)
        wrong[random() % wrong.size()] = static_cast<std::uint8_t>(random());
      try {
        decoder.decode(coding, shape, wrong, back);
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("damaged"), std::string::npos);
        ++refused;
      }
    }
    EXPECT_GT(refused, 100) << static_cast<int>(coding);
    // Another shape than it was packed from.
    for (const PixelShape other : {PixelShape{61, 40, 4}, {60, 39, 4}, {60, 40, 1}}) {
      back.resize(other.bytes());
      EXPECT_THROW(decoder.decode(coding, other, block, back), Error);
    }
    EXPECT_THROW(decoder.decode(coding, {32768, 32768, 4}, block, {}), Error);
    back.resize(shape.bytes());
  }
  EXPECT_THROW(decoder.decode(PixelCoding::raw, shape, pixels, {}), Error);
  EXPECT_THROW(encoder.encode(PixelCoding::raw, shape, pixels, 240), Error);
  EXPECT_THROW(encoder.encode(PixelCoding::jpeg, {60, 40, 1}, pixels, 240), Error);
}

/// The payload of \p view with its pixels packed.
std::vector<std::uint8_t> coded(const View& view, PixelCoding coding) {
  PixelEncoder encoder;
  const PixelShape shape{view.roi.width, view.roi.height, bytes_per_pixel(view.format)};
  const auto block = encoder.encode(coding, shape, view.pixels, view.stride);
  auto bytes = write_coded_view_header(view, coding, block.size());
  bytes.insert(bytes.end(), block.begin(), block.end());
  return bytes;
}

/// \p block with \p jpeg in the place of the JPEG that is there.
std::vector<std::uint8_t> with_jpeg(std::span<const std::uint8_t> block, Bytes jpeg) {
  std::size_t before = 0;
  for (std::size_t i = 0; i < 4; ++i) before |= static_cast<std::size_t>(block[i]) << (8 * i);
  std::vector<std::uint8_t> other;
  for (std::size_t i = 0; i < 4; ++i)
    other.push_back(static_cast<std::uint8_t>(jpeg.size() >> (8 * i)));
  other.insert(other.end(), jpeg.begin(), jpeg.end());
  other.insert(other.end(), block.begin() + static_cast<std::ptrdiff_t>(4 + before), block.end());
  return other;
}

// A kilobyte of what libjpeg reads besides can take minutes: progressive ones, arithmetic codes, and
// scans without end, each over the whole picture.
TEST(PixelCoding, OnlyPlainJpegsAreUnpacked) {
  const PixelShape shape{64, 48, 4};
  const std::vector<std::uint8_t> pixels = picture(shape, 256);
  PixelEncoder encoder;
  PixelDecoder decoder;
  const auto sound = encoder.encode(PixelCoding::jpeg, shape, pixels, 256, 90);
  const std::vector<std::uint8_t> block(sound.begin(), sound.end());
  std::vector<std::uint8_t> out(shape.bytes());
  EXPECT_NO_THROW(decoder.decode(PixelCoding::jpeg, shape, block, out));
  const auto expect_refused = [&](const PixelShape& of, std::span<const std::uint8_t> whole,
                                  Bytes jpeg, const char* what) {
    SCOPED_TRACE(what);
    std::vector<std::uint8_t> to(of.bytes());
    test::expect_refused([&] { decoder.decode(PixelCoding::jpeg, of, with_jpeg(whole, jpeg), to); },
                         "not of the kind that viewencode makes");
  };
  unsigned char* jpeg = nullptr;
  unsigned long size = 0;
  const tjhandle progressive = tjInitCompress();
  ASSERT_EQ(tjCompress2(progressive, pixels.data(), 64, 256, 48, TJPF_RGBX, &jpeg, &size,
                        TJSAMP_420, 90, TJFLAG_PROGRESSIVE),
            0);
  expect_refused(shape, block, {jpeg, size}, "a progressive JPEG");
  tjFree(jpeg);
  tjDestroy(progressive);

  // One block of grey: what its JPEG is, is known bit by bit.
  const PixelShape small{8, 8, 4};
  const std::vector<std::uint8_t> grey(small.bytes(), 128);
  const auto kept = encoder.encode(PixelCoding::jpeg, small, grey, 32, 90);
  const std::vector<std::uint8_t> whole(kept.begin(), kept.end());
  std::size_t length = 0;
  for (std::size_t i = 0; i < 4; ++i) length |= static_cast<std::size_t>(whole[i]) << (8 * i);
  const std::vector<std::uint8_t> plain(whole.begin() + 4,
                                        whole.begin() + 4 + static_cast<std::ptrdiff_t>(length));
  const auto find = [&](std::uint8_t marker) {
    for (std::size_t at = 2;; at += 2 + (plain[at + 2] << 8 | plain[at + 3]))
      if (plain.at(at + 1) == marker) return static_cast<std::ptrdiff_t>(at);
  };
  for (int kind = 0xc1; kind <= 0xcf; ++kind) {
    if (kind == 0xc4) continue;  // tables
    std::vector<std::uint8_t> other = plain;
    other[static_cast<std::size_t>(find(0xc0)) + 1] = static_cast<std::uint8_t>(kind);
    expect_refused(small, whole, other, "another frame header");
  }
  const std::vector<std::uint8_t> head(plain.begin(), plain.begin() + find(0xda));
  std::vector<std::uint8_t> split = head;
  for (const std::uint8_t part : {1, 2, 3}) {
    const std::uint8_t table = part == 1 ? 0x00 : 0x11, code = part == 1 ? 0x2b : 0x0f;
    for (const std::uint8_t byte : {0xff, 0xda, 0, 8, 1, +part, +table, 0, 0x3f, 0, +code})
      split.push_back(byte);
  }
  for (const std::uint8_t byte : {0xff, 0xd9}) split.push_back(byte);
  expect_refused(small, whole, split, "a JPEG of three scans");
  std::vector<std::uint8_t> twice(plain.begin(), plain.end() - 2);
  twice.insert(twice.end(), plain.begin() + find(0xda), plain.end());
  expect_refused(small, whole, twice, "a JPEG of two whole scans");
  for (std::size_t cut = 0; cut < plain.size(); ++cut) {
    std::vector<std::uint8_t> to(small.bytes());
    EXPECT_THROW(
        decoder.decode(PixelCoding::jpeg, small, with_jpeg(whole, Bytes(plain).first(cut)), to),
        Error)
        << cut;
  }
}

// Whatever came before, what is sound is unpacked.
TEST(PixelCoding, DamagedJpegsLeaveNothingBehind) {
  const PixelShape shape{60, 40, 4};
  const std::vector<std::uint8_t> pixels = picture(shape, 240);
  PixelEncoder encoder;
  PixelDecoder decoder;
  const auto kept = encoder.encode(PixelCoding::jpeg, shape, pixels, 240);
  const std::vector<std::uint8_t> block(kept.begin(), kept.end());
  std::vector<std::uint8_t> out(shape.bytes());
  int refused = 0;
  for (std::size_t at = 4; at < 700; ++at) {
    std::vector<std::uint8_t> wrong = block;
    wrong[at] ^= 0xff;
    try {
      decoder.decode(PixelCoding::jpeg, shape, wrong, out);
    } catch (const Error&) {
      ++refused;
    }
    ASSERT_NO_THROW(decoder.decode(PixelCoding::jpeg, shape, block, out)) << at;
  }
  EXPECT_GT(refused, 50);
}

TEST(CodedView, ComesBackAndSaysWhatReadsIt) {
  const auto pixels = examples::pixels(84 * 10, 3);
  const View view = examples::view("left", pixels);
  for (const PixelCoding coding : codings) {
    const auto bytes = coded(view, coding);
    const Bytes run(bytes);
    const CodedView read = read_coded_view({&run, 1});
    EXPECT_EQ(read.coding, coding);
    EXPECT_EQ(read.view.camera, "left");
    EXPECT_EQ(read.view.trigger, view.trigger);
    EXPECT_EQ(read.view.roi, view.roi);
    EXPECT_EQ(read.view.contours.points, view.contours.points);
    EXPECT_EQ(read.view.stride, 80);
    EXPECT_TRUE(read.view.pixels.empty());
    EXPECT_EQ(read_view_times({&run, 1}).capture_time, view.capture_time);
    try {
      read_view(run);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("viewdecode"), std::string::npos) << error.what();
    }
  }
  // One that is not packed is read, too.
  const auto raw = write_view(view);
  const Bytes run(raw);
  const CodedView read = read_coded_view({&run, 1});
  EXPECT_EQ(read.coding, PixelCoding::raw);
  EXPECT_EQ(read.block.size(), view.pixels.size());
}

TEST(CodedView, MutatedBytesAreRefusedOrHarmless) {
  const auto pixels = examples::pixels(84 * 10, 3);
  const View view = examples::view("left", pixels);
  std::mt19937 random(4);
  PixelDecoder decoder;
  int refused = 0, read = 0;
  for (const PixelCoding coding : codings) {
    const auto bytes = coded(view, coding);
    for (int round = 0; round < 20'000; ++round) {
      auto wrong = bytes;
      for (unsigned i = 0; i <= random() % 3; ++i)
        wrong[random() % wrong.size()] = static_cast<std::uint8_t>(
            random() % 2 != 0 ? random() : wrong[random() % wrong.size()]);
      const Bytes run(wrong);
      try {
        CodedView got = read_coded_view({&run, 1});
        if (got.coding == PixelCoding::raw) continue;
        std::vector<std::uint8_t> back(got.shape().bytes());
        decoder.decode(got.coding, got.shape(), got.block, back);
        got.view.pixels = back;
        validate_view(got.view);
        ++read;
      } catch (const Error&) {
        ++refused;
      }
    }
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const Bytes part(bytes.data(), size);
      EXPECT_THROW(read_coded_view({&part, 1}), Error);
    }
  }
  EXPECT_GT(read, 1000);
  EXPECT_GT(refused, 1000);
}

// As measured on a camera's pictures of 258 kB: shares and times of each coding.
TEST(CodingChoice, IsNeverFarFromTheBest) {
  constexpr std::size_t raw = 258'000;
  const CodingChoice::Trial trials[] = {
      {raw, 185'000, 0.38, 0.05}, {raw, 122'000, 0.63, 0.20}, {raw, 45'000, 0.36, 0.35}};
  for (const bool with_loss : {false, true})
    for (const double link : {10.0, 100.0, 300.0, 1000.0, 2500.0, 10'000.0, 100'000.0}) {
      CodingChoice choice;
      std::mt19937 random(3);
      std::uniform_real_distribution<double> unsteady(0.7, 1.3);
      double worst = 0;
      for (int i = 0; i < 500; ++i) {
        if (choice.trial_due())
          for (int c = 0; c < 3; ++c) {
            CodingChoice::Trial trial = trials[c];
            trial.pack_ms *= unsteady(random);
            trial.unpack_ms *= unsteady(random);
            choice.note(codings[c], trial);
          }
        const auto time = [&](PixelCoding coding) {
          if (coding == PixelCoding::raw) return static_cast<double>(raw) * 8e-3 / link;
          const auto& t = trials[static_cast<int>(coding) - 1];
          return t.pack_ms + t.unpack_ms + static_cast<double>(t.bytes) * 8e-3 / link;
        };
        double best = time(PixelCoding::raw);
        for (int c = 0; c < (with_loss ? 3 : 2); ++c) best = std::min(best, time(codings[c]));
        const PixelCoding chosen = choice.choose(raw, link, with_loss);
        EXPECT_TRUE(with_loss || chosen != PixelCoding::jpeg);
        worst = std::max(worst, time(chosen) / best);
      }
      EXPECT_LT(worst, 1.1) << link << (with_loss ? " with loss" : " without");
    }
}

TEST(CodingChoice, RawBeforeAnythingIsKnown) {
  CodingChoice choice;
  EXPECT_EQ(choice.choose(1000, 1.0, true), PixelCoding::raw);
  choice.note(PixelCoding::zstd, {0, 0, 0, 0});
  EXPECT_EQ(choice.choose(1000, 1.0, true), PixelCoding::raw);
  int trials = 0;
  for (int i = 0; i < 500; ++i) trials += choice.trial_due() ? 1 : 0;
  EXPECT_EQ(trials, 12);
}

}  // namespace
}  // namespace polyhull
