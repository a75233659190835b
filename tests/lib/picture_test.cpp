// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "base/error.h"

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

TEST(Picture, MissingFileIsNamed) {
  try {
    load_picture("/nowhere/missing.png");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), Error::Kind::not_found);
    EXPECT_NE(std::string(error.what()).find("/nowhere/missing.png"), std::string::npos);
  }
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
  try {
    decode_picture(bytes, 3, "picture");
    FAIL() << "decoded";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("Huffman"), std::string::npos) << error.what();
  }
}

TEST(Picture, UnwritablePathIsRefused) {
  EXPECT_THROW(save_picture(Picture{1, 1, 1, {0}}, "/nowhere/out.png"), Error);
  EXPECT_THROW(save_picture(Picture{1, 1, 1, {0}}, temporary("out.bmp")), Error);
}

}  // namespace
}  // namespace polyhull
