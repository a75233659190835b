// SPDX-License-Identifier: LGPL-2.1-or-later
#include "builtin/kept_pictures.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "builtin/room.h"
#include "builtin/room_textures.h"
#include "support/folder.h"

namespace polyhull {
namespace {

namespace fs = std::filesystem;

class KeptPictures : public testing::Test {
 protected:
  const test::Folder folder;
  const fs::path path = folder / "some" / "room.pictures";
};

void expect_same(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.pixels, b.pixels);
}

TEST_F(KeptPictures, AreFoundAsTheyWere) {
  EXPECT_TRUE(kept_pictures(path).empty()) << "of no file";
  const std::vector<Picture> pictures = {print_texture(31, 17, 1), wood_texture(12)};
  keep_pictures(pictures, path);
  const std::vector<Picture> kept = kept_pictures(path);
  ASSERT_EQ(kept.size(), 2u);
  expect_same(kept[0], pictures[0]);
  expect_same(kept[1], pictures[1]);
  EXPECT_EQ(std::distance(fs::directory_iterator(path.parent_path()), {}), 1)
      << "nothing unfinished is left";
}

TEST_F(KeptPictures, DamagedFilesAreNotUsed) {
  keep_pictures({wood_texture(12)}, path);
  std::string whole;
  {
    std::ifstream file(path, std::ios::binary);
    whole.assign(std::istreambuf_iterator<char>(file), {});
  }
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x5a);
    std::ofstream(path, std::ios::binary) << damaged;
    EXPECT_TRUE(kept_pictures(path).empty()) << "byte " << at;
    std::ofstream(path, std::ios::binary) << whole.substr(0, at);
    EXPECT_TRUE(kept_pictures(path).empty()) << "the first " << at;
  }
}

TEST_F(KeptPictures, WhereNoneCanBeKeptNothingHappens) {
  keep_pictures({wood_texture(12)}, path);
  keep_pictures({wood_texture(13)}, path / "below a file");
  EXPECT_EQ(kept_pictures(path).size(), 1u);
}

// A kept picture is taken when some of its pixels are right, and computed anew otherwise.
TEST(RoomTextures, AreComputedAnewUnlessTheKeptOneIsTheSame) {
  const Picture wood = wood_texture(64);
  Picture kept = wood;
  kept.pixels[4 * 7] ^=
      1;  // not among those that are looked at: it is the kept one that comes back
  expect_same(wood_texture(64, kept), kept);
  for (const std::size_t pixel : {std::size_t{0}, std::size_t{101}, std::size_t{4040}}) {
    Picture other = wood;
    other.pixels[4 * pixel + 1] ^= 1;
    expect_same(wood_texture(64, other), wood);
  }
  expect_same(wood_texture(64, wood_texture(32)), wood);
  expect_same(wood_texture(64, stone_texture(64)), wood);
}

TEST(RoomTextures, OfTheRoomAreKept) {
  const test::Folder folder;
  const Scene room = room_scene(folder.path);
  const std::vector<Picture> kept = kept_pictures(folder / "room.pictures");
  ASSERT_EQ(kept.size(), room.textures.size());
  for (std::size_t i = 0; i < kept.size(); ++i) expect_same(kept[i], *room.textures[i]);
}

}  // namespace
}  // namespace polyhull
