// SPDX-License-Identifier: LGPL-2.1-or-later
// Takes whose packets are packed: sought, added to, killed, damaged, read while they are written.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <random>

#include "base/error.h"
#include "killed_writer.h"
#include "support/folder.h"
#include "support/refusal.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

namespace polyhull {
namespace {

constexpr std::int64_t frame = 40'000'000;
constexpr int interval = 6;
using Existing = TakeWriter::Existing;
using Data = std::vector<std::uint8_t>;

/// What camera \p camera sees at instant \p number: much of it as before.
Data content(int camera, int number) {
  Data bytes(4000);
  std::minstd_rand still(static_cast<unsigned>(1 + camera));
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(still() >> 8);
  std::minstd_rand moving(static_cast<unsigned>(100 + camera * 100'003 + number));
  for (std::size_t i = 0; i < 400; ++i) bytes[i] = static_cast<std::uint8_t>(moving() >> 8);
  bytes.insert(bytes.end(), 200, 7);  // smaller even alone
  return bytes;
}

/// Writes cameras that are packed.
struct Cameras {
  Cameras(TakeWriter& take, int count, unsigned key_interval = interval) : take(take) {
    for (int c = 0; c < count; ++c) streams.push_back(take.stream("cam" + std::to_string(c)));
    packers.resize(streams.size());
    before.resize(streams.size());
    settings.packing = Packing::exact;
    settings.key_interval = key_interval;
  }
  /// Instant \p at of the take, which shows what instant \p number does.
  void write(int at, int number) {
    for (std::size_t c = 0; c < streams.size(); ++c) {
      const Data data = content(static_cast<int>(c), number);
      const TakePacket packet{"application/x-test", at * frame, frame, 0, {}};
      const PackedPacket packed = packers[c].pack(settings, packet.caps, data, before[c]);
      ASSERT_FALSE(packed.data.empty());
      before[c] = take.write(streams[c], packet, packed.data, true);
    }
  }
  void write(int from, int to, int offset) {
    for (int i = from; i < to; ++i) write(i, i + offset);
  }
  TakeWriter& take;
  std::vector<std::int64_t> streams, before;
  std::vector<PacketPacker> packers;
  PackingSettings settings;
};

class PackedTakes : public testing::Test {
 protected:
  void write(int cameras, int frames) {
    TakeWriter take(path, Existing::refuse);
    Cameras(take, cameras).write(0, frames, 0);
  }
  std::int64_t stream(int camera) {
    return read_take(path).streams.at(static_cast<std::size_t>(camera)).id;
  }
  /// All of a camera's packets are what was written; their number.
  int count_sound(int camera) {
    TakeCursor cursor(path, stream(camera));
    int count = 0;
    while (const auto read = cursor.next()) {
      EXPECT_EQ(read->data, content(camera, static_cast<int>(read->time / frame)));
      ++count;
    }
    EXPECT_EQ(cursor.damaged(), 0u);
    return count;
  }
  std::int64_t ask(const std::string& sql) {
    sqlite3* base = nullptr;
    sqlite3_open(path.c_str(), &base);
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(base, sql.c_str(), -1, &statement, nullptr), SQLITE_OK)
        << sqlite3_errmsg(base);
    const std::int64_t answer =
        sqlite3_step(statement) == SQLITE_ROW ? sqlite3_column_int64(statement, 0) : -1;
    sqlite3_finalize(statement);
    sqlite3_close(base);
    return answer;
  }

  const test::Folder folder;
  const std::string path = folder.file("dance.take");
};

TEST_F(PackedTakes, WhatIsWrittenIsRead) {
  write(2, 50);
  for (int c = 0; c < 2; ++c) EXPECT_EQ(count_sound(c), 50);
  EXPECT_EQ(ask("PRAGMA user_version"), 2);
  EXPECT_LT(ask("SELECT sum(length(data)) FROM packet"), 100 * 4200 / 3);
  TakeCursor cursor(path, stream(1));
  for (int i = 0; i < 50; ++i) {
    const auto read = cursor.next();
    ASSERT_TRUE(read);
    EXPECT_EQ(read->alone, i % interval == 0);
    EXPECT_LT(read->stored, read->alone ? 4200u : 1000u);
  }
}

TEST_F(PackedTakes, WithoutCompressionOlderProgramsReadIt) {
  TakeWriter take(path, Existing::refuse);
  take.write(take.stream("cam0"), {"application/x-test", 0, frame, 0, {}}, content(0, 0));
  take.finish();
  EXPECT_EQ(ask("PRAGMA user_version"), 1);
}

TEST_F(PackedTakes, AnyPlaceIsFoundInBothDirections) {
  write(2, 120);
  TakeCursor cursor(path, stream(1));
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    const int number = static_cast<int>(random() % 118);
    const bool backwards = i % 2 == 1;
    cursor.seek(number * frame + (backwards ? 7 : -7), backwards);
    for (int step = 0; step < 3; ++step) {
      const int expected = number + (backwards ? -step : step);
      const auto read = cursor.next();
      if (expected < 0 || expected >= 120) {
        EXPECT_FALSE(read);
        break;
      }
      ASSERT_TRUE(read);
      EXPECT_EQ(read->time, expected * frame);
      EXPECT_EQ(read->data, content(1, expected)) << expected;
    }
  }
  // The same place again, and the one before it.
  cursor.seek(40 * frame);
  ASSERT_TRUE(cursor.next());
  cursor.seek(40 * frame);
  EXPECT_EQ(cursor.next()->data, content(1, 40));
  cursor.seek(39 * frame);
  EXPECT_EQ(cursor.next()->data, content(1, 39));
}

// A take of before, which has no packed packet, and one that a packing writer has begun.
TEST_F(PackedTakes, WhatIsAddedLaterFollows) {
  {
    TakeWriter take(path, Existing::refuse);
    for (int i = 0; i < 10; ++i)
      take.write(take.stream("cam0"), {"application/x-test", i * frame, frame, 0, {}},
                 content(0, i));
  }
  EXPECT_EQ(ask("PRAGMA user_version"), 1);
  for (int part = 1; part < 4; ++part) {
    TakeWriter take(path, Existing::append);
    EXPECT_EQ(take.begin(), part * 10 * frame);
    Cameras(take, 1).write(0, 10, part * 10);
  }
  EXPECT_EQ(ask("PRAGMA user_version"), 2);
  {
    TakeWriter take(path, Existing::append);
    for (int i = 0; i < 10; ++i)
      take.write(take.stream("cam0"), {"application/x-test", i * frame, frame, 0, {}},
                 content(0, 40 + i));
  }
  EXPECT_EQ(count_sound(0), 50);
}

TEST_F(PackedTakes, ItIsReadWhileItIsWritten) {
  TakeWriter take(path, Existing::refuse);
  Cameras cameras(take, 2);
  for (int i = 0; i < 25; ++i) {
    cameras.write(i, i);
    EXPECT_GE(count_sound(0), i);
  }
}

TEST_F(PackedTakes, AWriterKilledAtAnyMomentLeavesAllButTheLastSet) {
  std::mt19937 random(11);
  for (int round = 0; round < 8; ++round) {
    std::filesystem::remove(path);
    std::filesystem::remove(path + "-journal");
    const auto begin_take = [&] {
      const auto take = std::make_shared<TakeWriter>(path, Existing::replace);
      const auto cameras = std::make_shared<Cameras>(*take, 2);
      return [take, cameras](int i) { cameras->write(i, i); };
    };
    const int last = test::last_of_killed(begin_take, random);
    int count = 0;
    for (int c = 0; c < 2; ++c) EXPECT_GE(count = count_sound(c), last) << "round " << round;
    TakeWriter take(path, Existing::append);
    const auto begin = static_cast<int>(take.begin() / frame);
    Cameras(take, 2).write(0, 3, begin);
    take.finish();
    EXPECT_EQ(count_sound(1), begin + 3) << count;
  }
}

// What is damaged takes with it what was packed behind it, up to the next that stands alone.
TEST_F(PackedTakes, DamageEndsAtTheNextKey) {
  for (const int damaged : {0, 6, 7, 8, 11, 12, 29}) {
    std::filesystem::remove(path);
    write(1, 30);
    ask("UPDATE packet SET data = CAST(zeroblob(40) || substr(data, 41) AS BLOB) WHERE time = " +
        std::to_string(damaged * frame));
    const int next = std::min(30, (damaged / interval + 1) * interval);
    for (const bool backwards : {false, true}) {
      TakeCursor cursor(path, stream(0));
      cursor.seek(backwards ? 30 * frame : 0, backwards);
      std::vector<int> whole;
      while (const auto read = cursor.next()) {
        whole.push_back(static_cast<int>(read->time / frame));
        EXPECT_EQ(read->data, content(0, whole.back()));
      }
      std::vector<int> expected;
      for (int i = 0; i < 30; ++i)
        if (i < damaged || i >= next) expected.push_back(i);
      if (backwards) std::reverse(expected.begin(), expected.end());
      EXPECT_EQ(whole, expected) << damaged;
      EXPECT_EQ(cursor.damaged(), static_cast<std::uint64_t>(next - damaged)) << damaged;
    }
  }
}

// A packed packet whose sums are right, but which names one that it cannot be packed behind.
TEST_F(PackedTakes, PacketsThatNameOthersAreNotFollowedForever) {
  {
    TakeWriter take(path, Existing::refuse);
    Cameras cameras(take, 2);
    cameras.write(0, 3, 0);
    for (const std::int64_t named : {std::int64_t{-7}, std::int64_t{7}, std::int64_t{9}, INT64_MAX,
                                     std::int64_t{2} /* the other's */}) {
      PacketPacker other;
      other.pack(cameras.settings, "application/x-test", content(0, 2), 0);
      const PackedPacket lie =
          other.pack(cameras.settings, "application/x-test", content(0, 3), named);
      take.write(cameras.streams[0], {"application/x-test", 4 * frame, frame, 0, {}}, lie.data);
    }
  }
  ask("UPDATE packet SET flags = 4294967296 WHERE id > 6");
  TakeCursor cursor(path, stream(0));
  int count = 0;
  while (cursor.next()) ++count;
  EXPECT_EQ(count, 3);
  EXPECT_EQ(cursor.damaged(), 5u);
}

// What was lost with a transaction that failed is not counted on.
TEST_F(PackedTakes, NothingIsPackedBehindWhatIsNotTheLast) {
  TakeWriter take(path, Existing::refuse);
  Cameras cameras(take, 2);
  cameras.write(0, 0);
  std::swap(cameras.before[0], cameras.before[1]);
  const PackedPacket packed = cameras.packers[0].pack(cameras.settings, "application/x-test",
                                                      content(0, 1), cameras.before[0]);
  const TakePacket packet{"application/x-test", frame, frame, 0, {}};
  EXPECT_THROW(take.write(cameras.streams[0], packet, packed.data, true), Error);
  cameras.before = {0, 0};
  cameras.write(1, 1);
  take.finish();
  EXPECT_EQ(count_sound(0), 2);
}

// Nobody's settings make a chain longer than what is followed.
TEST_F(PackedTakes, ChainsAreFollowedToTheirLongest) {
  {
    TakeWriter take(path, Existing::refuse);
    Cameras(take, 1, longest_key_interval).write(0, 260, 0);
  }
  TakeCursor cursor(path, stream(0));
  cursor.seek(249 * frame);
  EXPECT_EQ(cursor.next()->data, content(0, 249));
  EXPECT_TRUE(cursor.next()->alone);
}

// What the last transaction held is gone: packets, and a stream that was new.
TEST_F(PackedTakes, AfterAFullDiskAllGoesOn) {
  TakeWriter take(path, Existing::refuse);
  Cameras cameras(take, 2);
  cameras.write(0, 10, 0);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = std::filesystem::file_size(path);
  setrlimit(RLIMIT_FSIZE, &small);
  std::int64_t late = 0;
  int at = 10;
  test::expect_refused(
      [&] {
        for (; at < 1000; ++at) {
          cameras.write(at, at);
          late = take.stream("late" + std::to_string(at));
          take.write(late, {"application/x-test", at * frame, frame, 0, {}}, content(5, at));
        };
      },
      "disk is full");
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_DFL);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(take.last_packed(cameras.streams[c]), 0);
    EXPECT_NE(cameras.before[c], 0);
    cameras.before[c] = take.last_packed(cameras.streams[c]);
  }
  const std::int64_t other = take.stream("other");
  EXPECT_NE(other, late);
  cameras.write(at, at + 20, 0);
  const TakePacket last{"application/x-test", at * frame, frame, 0, {}};
  take.write(late, last, content(5, at));
  take.write(other, last, content(6, at));
  for (std::size_t c = 0; c < 2; ++c)
    EXPECT_EQ(take.last_packed(cameras.streams[c]), cameras.before[c]);
  take.finish();
  for (int c = 0; c < 2; ++c) EXPECT_GE(count_sound(c), 28);
  std::vector<std::string> names;
  for (const TakeStream& stream : read_take(path).streams) {
    names.push_back(stream.name);
    TakeCursor cursor(path, stream.id);
    if (stream.id == late) {
      EXPECT_TRUE(cursor.next());
    }
  }
  EXPECT_NE(std::find(names.begin(), names.end(), "late" + std::to_string(at - 1)), names.end());
}

}  // namespace
}  // namespace polyhull
