// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "support/refusal.h"

namespace polyhull {
namespace {

std::string temporary(const std::string& name) {
  return (std::filesystem::temp_directory_path() / ("polyhull_picture_" + name)).string();
}

TEST(Picture, PngComesBackAsWritten) {
  Picture picture{3, 2, 4, {}};
  for (int i = 0; i < 3 * 2 * 4; ++i) picture.pixels.push_back(static_cast<std::uint8_t>(i * 10));
  const std::string path = temporary("roundtrip.png");
  save_picture(picture, path);
  const Picture read = load_picture(path);
  EXPECT_EQ(read.width, 3);
  EXPECT_EQ(read.height, 2);
  EXPECT_EQ(read.channels, 4);
  EXPECT_EQ(read.pixels, picture.pixels);
}

TEST(Picture, SixteenBitsAreKept) {
  // 3x1 grey pixels of 0, 255 and 254 in sixteen bits.
  constexpr unsigned char bytes[] = {
      137, 80,  78,  71, 13, 10,  26,  10, 0,  0,  0,  13,  73,  72,  68,  82, 0,  0,
      0,   3,   0,   0,  0,  1,   16,  0,  0,  0,  0,  110, 27,  151, 43,  0,  0,  0,
      15,  73,  68,  65, 84, 120, 156, 99, 96, 96, 96, 248, 207, 240, 15,  0,  4,  2,
      1,   254, 246, 47, 56, 134, 0,   0,  0,  0,  73, 69,  78,  68,  174, 66, 96, 130};
  const std::string path = temporary("deep.png");
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes), sizeof bytes);
  const DeepPicture deep = load_deep_picture(path);
  EXPECT_EQ(deep.full, 65535);
  EXPECT_EQ(deep.samples, (std::vector<std::uint16_t>{0, 255, 254}));
  EXPECT_EQ(load_grey_mask(path).pixels, (std::vector<std::uint8_t>{0, 255, 254}));
}

TEST(Picture, AMaskIsTakenByItsOwnLargestValue) {
  const auto levels = [](int full, std::vector<std::uint16_t> samples) {
    return mask_levels({static_cast<int>(samples.size()), 1, 1, full, samples}, 0);
  };
  using Levels = std::vector<std::uint8_t>;
  EXPECT_EQ(levels(255, {0, 1, 1}).picture.pixels, (Levels{0, 255, 255}));
  EXPECT_EQ(levels(65535, {0, 1, 1}).picture.pixels, (Levels{0, 255, 255}));
  EXPECT_EQ(levels(65535, {0, 255, 128}).picture.pixels, (Levels{0, 0, 0}));  // half is in shades
  EXPECT_EQ(levels(65535, {0, 255, 255, 128}).picture.pixels, (Levels{0, 255, 255, 128}));
  EXPECT_TRUE(levels(255, {0, 200, 200}).by_own);
  // As they are: full masks, noise of a black one, black.
  EXPECT_EQ(levels(255, {0, 240, 240, 100}).picture.pixels, (Levels{0, 240, 240, 100}));
  EXPECT_EQ(levels(65535, {0, 65535, 32768}).picture.pixels, (Levels{0, 255, 128}));
  EXPECT_EQ(levels(255, {0, 1, 1, 2, 3, 1}).picture.pixels, (Levels{0, 1, 1, 2, 3, 1}));
  EXPECT_FALSE(levels(255, {0, 0}).by_own);
}

TEST(Picture, MissingFileIsNamed) {
  test::expect_refused([&] { load_picture("/nowhere/missing.png"); }, {"/nowhere/missing.png"},
                       Error::Kind::not_found);
}

TEST(Picture, AFolderIsRefused) {
  EXPECT_THROW(load_picture("/tmp", 3), Error);
}

TEST(Picture, BrokenFileIsRefused) {
  const std::string path = temporary("broken.png");
  std::ofstream(path) << "not a picture";
  EXPECT_THROW(load_picture(path), Error);
}

// More codes than a table can have would be written over what lies behind it.
TEST(Picture, DamagedHuffmanTablesAreRefused) {
  std::vector<std::uint8_t> bytes = encode_jpeg({8, 8, 3, std::vector<std::uint8_t>(192, 90)}, 90);
  EXPECT_EQ(decode_picture(bytes, 3, "picture").width, 8);
  const std::uint8_t marker[] = {0xFF, 0xC4};
  const auto table = std::search(bytes.begin(), bytes.end(), std::begin(marker), std::end(marker));
  ASSERT_NE(table, bytes.end());
  std::fill_n(table + 5, 16, std::uint8_t{255});
  test::expect_refused([&] { decode_picture(bytes, 3, "picture"); }, "Huffman");
}

TEST(Picture, UnwritablePathIsRefused) {
  EXPECT_THROW(save_picture(Picture{1, 1, 1, {0}}, "/nowhere/out.png"), Error);
  EXPECT_THROW(save_picture(Picture{1, 1, 1, {0}}, temporary("out.bmp")), Error);
}

}  // namespace
}  // namespace polyhull
