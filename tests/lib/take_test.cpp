// SPDX-License-Identifier: LGPL-2.1-or-later
// Takes: written, read, killed, damaged, on a full disk.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
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
using Existing = TakeWriter::Existing;

class Takes : public testing::Test {
 protected:
  const test::Folder folder;
  const std::string path = folder.file("dance.take");
};

/// What camera \p camera sees at instant \p number: bytes that tell both.
std::vector<std::uint8_t> content(int camera, int number, std::size_t size = 5000) {
  std::vector<std::uint8_t> bytes(size);
  std::minstd_rand random(static_cast<unsigned>(1 + camera * 100'003 + number));
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() >> 8);
  return bytes;
}

TakePacket packet(int number) {
  return {"application/x-polyhull-view",
          number * frame,
          frame,
          static_cast<std::uint32_t>(number % 3),
          {}};
}

/// Instants [from, to) of so many cameras.
void write(TakeWriter& take, int cameras, int from, int to, std::size_t size = 5000) {
  for (int i = from; i < to; ++i)
    for (int c = 0; c < cameras; ++c)
      take.write(take.stream("cam" + std::to_string(c)), packet(i), content(c, i, size));
}

/// Reads all of stream \p name and holds each packet against what was written.
int count_sound(const std::string& path, const std::string& name, int camera,
                std::size_t size = 5000) {
  for (const TakeStream& stream : read_take(path).streams) {
    if (stream.name != name) continue;
    TakeCursor cursor(path, stream.id);
    int count = 0;
    while (const auto read = cursor.next()) {
      const int number = static_cast<int>(read->time / frame);
      EXPECT_EQ(read->time, number * frame);
      EXPECT_EQ(read->duration, frame);
      EXPECT_EQ(read->flags, static_cast<std::uint32_t>(number % 3));
      EXPECT_EQ(read->data, content(camera, number, size)) << number;
      ++count;
    }
    return count;
  }
  return 0;
}

void execute(const std::string& path, const char* sql) {
  sqlite3* base = nullptr;
  sqlite3_open(path.c_str(), &base);
  EXPECT_EQ(sqlite3_exec(base, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(base);
  sqlite3_close(base);
}

TEST_F(Takes, WhatIsWrittenIsRead) {
  {
    TakeWriter take(path, Existing::refuse);
    take.note("rig", "{}");
    take.note("rig", "{ \"cameras\": [] }");
    write(take, 3, 0, 50);
    TakePacket other = packet(50);
    other.caps = "audio/x-raw, rate=48000";
    other.duration = no_take_time;
    take.write(take.stream("sound"), other, {});
    take.finish();
  }
  EXPECT_FALSE(std::filesystem::exists(path + "-journal"));
  const TakeContent content = read_take(path);
  ASSERT_EQ(content.streams.size(), 4u);
  EXPECT_EQ(content.streams[2].name, "cam2");
  EXPECT_EQ(content.streams[2].begin, 0);
  EXPECT_EQ(content.streams[2].end, 50 * frame);
  EXPECT_EQ(content.streams[3].begin, 50 * frame);
  EXPECT_EQ(content.end, 50 * frame);
  ASSERT_EQ(content.notes.size(), 1u);
  EXPECT_EQ(content.notes[0].value, "{ \"cameras\": [] }");
  for (int c = 0; c < 3; ++c) EXPECT_EQ(count_sound(path, "cam" + std::to_string(c), c), 50);
  TakeCursor sound(path, content.streams[3].id);
  const auto read = sound.next();
  ASSERT_TRUE(read);
  EXPECT_EQ(read->caps, "audio/x-raw, rate=48000");
  EXPECT_EQ(read->duration, no_take_time);
  EXPECT_TRUE(read->data.empty());
  EXPECT_FALSE(sound.next());
}

TEST_F(Takes, AnyPlaceIsFoundInBothDirections) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 2, 0, 200);
  }
  TakeCursor cursor(path, read_take(path).streams[1].id);
  std::mt19937 random(3);
  for (int i = 0; i < 300; ++i) {
    const int number = static_cast<int>(random() % 198);
    const bool backwards = i % 2 == 1;
    cursor.seek(number * frame + (backwards ? 7 : -7), backwards);
    for (int step = 0; step < 2; ++step) {
      const auto read = cursor.next();
      const int expected = number + (backwards ? -step : step);
      if (expected < 0) {
        EXPECT_FALSE(read);
      } else {
        ASSERT_TRUE(read);
        EXPECT_EQ(read->time, expected * frame);
      }
    }
  }
  cursor.seek(200 * frame);
  EXPECT_FALSE(cursor.next());
}

TEST_F(Takes, WhatIsAddedLaterFollows) {
  for (int part = 0; part < 3; ++part) {
    TakeWriter take(path, Existing::append);
    EXPECT_EQ(take.begin(), part * 20 * frame);
    for (int i = 0; i < 20; ++i)
      for (int c = 0; c < 2; ++c) {
        TakePacket next = packet(i);
        next.flags = static_cast<std::uint32_t>((part * 20 + i) % 3);
        take.write(take.stream("cam" + std::to_string(c)), next, content(c, part * 20 + i));
      }
    take.finish();
  }
  EXPECT_EQ(read_take(path).streams.size(), 2u);
  EXPECT_EQ(count_sound(path, "cam1", 1), 60);
}

// A last packet that does not say how long it lasts does as long as the one before.
TEST_F(Takes, WhatIsAddedLaterNeverComesWithTheLast) {
  TakePacket next = packet(0);
  next.duration = no_take_time;
  {
    TakeWriter take(path, Existing::refuse);
    take.write(take.stream("cam0"), next, content(0, 0));
  }
  {
    TakeWriter take(path, Existing::append);
    EXPECT_EQ(take.begin(), 40'000'000);
    next.time = 5'000'000;
    take.write(take.stream("cam0"), next, content(0, 0));
    next.time = 15'000'000;
    take.write(take.stream("cam0"), next, content(0, 0));
  }
  TakeWriter take(path, Existing::append);
  EXPECT_EQ(take.begin(), 65'000'000);
}

TEST_F(Takes, AWriterKilledAtAnyMomentLeavesAllButTheLastSet) {
  constexpr int cameras = 3;
  std::mt19937 random(11);
  const char* rounds = std::getenv("POLYHULL_KILLS");
  const int kills = rounds != nullptr ? std::atoi(rounds) : 12;
  int whole = 0;
  for (int round = 0; round < kills; ++round) {
    std::filesystem::remove(path);
    std::filesystem::remove(path + "-journal");
    const auto begin_take = [&] {
      return [take = std::make_shared<TakeWriter>(path, Existing::replace)](int i) {
        write(*take, cameras, i, i + 1, 60'000);
      };
    };
    const int last = test::last_of_killed(begin_take, random);
    // Sets 0 to `last` were written, and all but the last of them committed.
    for (int c = 0; c < cameras; ++c)
      EXPECT_GE(count_sound(path, "cam" + std::to_string(c), c, 60'000), last) << "round " << round;
    ++whole;
    // And more can be added.
    TakeWriter take(path, Existing::append);
    const std::int64_t begin = take.begin();
    write(take, cameras, 0, 2, 60'000);
    take.finish();
    EXPECT_EQ(read_take(path).streams[0].end, begin + 2 * frame);
  }
  std::printf("%d of %d killed writers left all but the last set\n", whole, kills);
}

TEST_F(Takes, ADamagedTakeGivesWhatIsWhole) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 2, 0, 100, 100'000);
  }
  const auto size = std::filesystem::file_size(path);
  const std::string sound = folder.file("sound.take");
  std::filesystem::copy_file(path, sound);
  std::mt19937 random(5);
  int readable = 0, found = 0, lost = 0;
  for (int round = 0; round < 40; ++round) {
    std::filesystem::copy_file(sound, path, std::filesystem::copy_options::overwrite_existing);
    {
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      // Somewhere behind the tables' list, a byte or a stretch.
      file.seekp(static_cast<std::streamoff>(32768 + random() % (size - 52768)));
      const std::string garbage(round % 2 == 0 ? 1 : 20'000, static_cast<char>(random()));
      file.write(garbage.data(), static_cast<std::streamsize>(garbage.size()));
    }
    try {
      for (const TakeStream& stream : read_take(path).streams) {
        const int camera = stream.id == 1 ? 0 : 1;
        TakeCursor cursor(path, stream.id);
        int count = 0;
        while (const auto read = cursor.next()) {
          EXPECT_EQ(read->data, content(camera, static_cast<int>(read->time / frame), 100'000));
          ++count;
        }
        EXPECT_LE(count, 100);
        if (count < 100) {
          EXPECT_GT(cursor.damaged(), 0u);
        }
        found += count;
        lost += 100 - count;
      }
      ++readable;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("damaged"), std::string::npos) << error.what();
    }
  }
  std::printf("%d of 40 damaged takes readable, of them %d packets whole, %d lost\n", readable,
              found, lost);
  EXPECT_EQ(readable, 40);
  EXPECT_LT(lost, found / 20);
}

// The lists of streams, formats and notes, and the index, each on pages of their own.
TEST_F(Takes, NoPageButTheFirstIsNeeded) {
  {
    TakeWriter take(path, Existing::refuse);
    take.note("rig", "{}");
    write(take, 2, 0, 40);
  }
  const auto size = std::filesystem::file_size(path);
  const std::string sound = folder.file("sound.take");
  std::filesystem::copy_file(path, sound);
  int lost = 0;
  for (std::uintmax_t at = 32768; at < size; at += 32768) {
    std::filesystem::copy_file(sound, path, std::filesystem::copy_options::overwrite_existing);
    std::fstream(path, std::ios::in | std::ios::out | std::ios::binary)
        .seekp(static_cast<std::streamoff>(at))
        .write(std::string(32768, '\xa5').data(), 32768);
    int count = 0;
    for (const TakeStream& stream : read_take(path).streams) {
      TakeCursor cursor(path, stream.id);
      while (const auto read = cursor.next()) {
        EXPECT_EQ(read->data,
                  content(static_cast<int>(stream.id) - 1, static_cast<int>(read->time / frame)));
        ++count;
      }
    }
    if (count == 0)
      ++lost;
    else
      EXPECT_GE(count, 70) << "page " << at / 32768;
  }
  // That from which all packets' pages are found has to be there.
  EXPECT_LE(lost, 1);
}

TEST_F(Takes, WhatNoWriterMakesIsRefused) {
  for (const char* sql :
       {"CREATE\tVIRTUAL TABLE other USING fts5(a)",
        "CREATE TABLE big (id INTEGER PRIMARY KEY, text AS (hex(zeroblob(id * 400000000))))",
        "CREATE VIEW seen AS SELECT * FROM packet",
        "WITH RECURSIVE n(i) AS (SELECT 3 UNION ALL SELECT i + 1 FROM n WHERE i < 300) "
        "INSERT INTO stream (id, name) SELECT i, 'sink_' || i FROM n"}) {
    std::filesystem::remove(path);
    {
      TakeWriter take(path, Existing::refuse);
      write(take, 2, 0, 4);
    }
    execute(path, sql);
    EXPECT_THROW(read_take(path), Error) << sql;
  }
}

TEST_F(Takes, CapsThatNoReaderBearsAreAsDamaged) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 2, 0, 4);
  }
  execute(path, "UPDATE format SET caps = replace(hex(zeroblob(20)), '0', '{') WHERE stream = 1");
  EXPECT_FALSE(TakeCursor(path, 1).next());
  EXPECT_TRUE(TakeCursor(path, 2).next());
}

TEST_F(Takes, OfATakeThatIsCutOffTheRestIsRead) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 1, 0, 100, 50'000);
  }
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 19 / 20);
  EXPECT_GE(count_sound(path, "cam0", 0, 50'000), 90);
}

// Sound that is written far ahead of the pictures holds none of them back.
TEST_F(Takes, AStreamThatIsAheadHoldsNothingBack) {
  TakeWriter take(path, Existing::refuse);
  take.write(take.stream("ahead"), packet(1000), content(1, 1000));
  for (int i = 0; i < 20; ++i) {
    write(take, 1, i, i + 1);
    EXPECT_GE(count_sound(path, "cam0", 0), i);
  }
}

// Streams whose times stand still are committed all the same.
TEST_F(Takes, WhatIsOldIsCommittedWhateverItsTime) {
  TakeWriter take(path, Existing::refuse);
  const std::int64_t stream = take.stream("untimed");
  for (int i = 0; i < 5; ++i) take.write(stream, packet(0), content(0, 0));
  EXPECT_EQ(count_sound(path, "untimed", 0), 0);
  usleep(1'100'000);
  take.write(stream, packet(0), content(0, 0));
  EXPECT_EQ(count_sound(path, "untimed", 0), 5);
}

TEST_F(Takes, WhatIsMuchIsCommittedWhateverItsTime) {
  TakeWriter take(path, Existing::refuse);
  const std::int64_t stream = take.stream("untimed");
  const std::vector<std::uint8_t> much(22 << 20);
  for (int i = 0; i < 4; ++i) take.write(stream, packet(0), much);
  EXPECT_EQ(read_take(path).streams[0].end, frame);
}

// An instant that is larger than SQLite's cache is written to the file only when it is committed.
TEST_F(Takes, CanBeReadWhileALargeInstantIsWritten) {
  TakeWriter take(path, Existing::refuse);
  write(take, 4, 0, 1, 8'000'000);
  write(take, 4, 1, 2, 8'000'000);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(count_sound(path, "cam3", 3, 8'000'000), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

/// Another program that reads the file, and does not stop.
struct SlowReader {
  explicit SlowReader(const std::string& path) {
    sqlite3_open(path.c_str(), &base);
    sqlite3_prepare_v2(base, "SELECT id FROM packet", -1, &statement, nullptr);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
  }
  ~SlowReader() {
    sqlite3_finalize(statement);
    sqlite3_close(base);
  }
  sqlite3* base = nullptr;
  sqlite3_stmt* statement = nullptr;
};

TEST_F(Takes, ASlowReaderHoldsUpNothing) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 2, 0, 5);
    {
      const SlowReader slow(path);
      const auto begin = std::chrono::steady_clock::now();
      write(take, 2, 5, 105);
      EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
      EXPECT_TRUE(take.held_up());
    }
    write(take, 2, 105, 107);
    EXPECT_FALSE(take.held_up());
    EXPECT_EQ(count_sound(path, "cam1", 1), 106);
    take.finish();
  }
  EXPECT_EQ(count_sound(path, "cam0", 0), 107);
  EXPECT_EQ(count_sound(path, "cam1", 1), 107);
}

TEST_F(Takes, AReaderThatDoesNotStopIsSaidAtTheEnd) {
  TakeWriter take(path, Existing::refuse);
  write(take, 2, 0, 6);
  const SlowReader slow(path);
  write(take, 2, 6, 10);
  EXPECT_FALSE(take.commit(10));
  test::expect_refused([&] { take.finish(50); }, {"has been reading it"}, Error::Kind::io);
  EXPECT_EQ(count_sound(path, "cam0", 0), 5);
}

TEST_F(Takes, OneWriterAtATime) {
  TakeWriter take(path, Existing::refuse);
  write(take, 1, 0, 5);
  for (const Existing existing : {Existing::append, Existing::replace}) {
    test::expect_refused([&] { TakeWriter second(path, existing); }, "another program or element");
  }
  write(take, 1, 5, 10);
  take.finish();
  EXPECT_EQ(count_sound(path, "cam0", 0), 10);
}

TEST_F(Takes, AFullDiskIsSaidAndWhatWasWrittenStays) {
  // A file that may not grow any more is what a full disk is to its writer.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  int sets = 0;
  {
    TakeWriter take(path, Existing::refuse);
    rlimit small = before;
    small.rlim_cur = 3'000'000;
    setrlimit(RLIMIT_FSIZE, &small);
    test::expect_refused(
        [&] {
          for (; sets < 1000; ++sets) write(take, 2, sets, sets + 1, 50'000);
        },
        {"disk is full"}, Error::Kind::io);
    setrlimit(RLIMIT_FSIZE, &before);
  }
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_GT(sets, 10);
  EXPECT_GE(count_sound(path, "cam0", 0, 50'000), sets - 1);
}

/// What each packet of the only stream was announced by, in the order of time.
std::vector<std::string> announced(const std::string& path, std::uint64_t* damaged = nullptr) {
  TakeCursor cursor(path, read_take(path).streams.at(0).id);
  std::vector<std::string> all;
  while (const auto read = cursor.next())
    all.push_back(read->event == 0 ? "none" : cursor.announcement(read->event));
  if (damaged != nullptr) *damaged = cursor.damaged();
  return all;
}

TEST_F(Takes, AnnouncementsHoldFromTheirPacketOn) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 1, 0, 1);
    take.announce(take.stream("cam0"), "a");
    write(take, 1, 1, 3);
    take.announce(take.stream("cam0"), "b");
    take.announce(take.stream("cam0"), "c");
    write(take, 1, 3, 4);
    take.announce(take.stream("cam0"), "c");
    write(take, 1, 4, 5);
  }
  EXPECT_EQ(announced(path), (std::vector<std::string>{"none", "a", "a", "c", "c"}));
  TakeCursor cursor(path, 1);
  for (const bool backwards : {false, true}) {
    cursor.seek(2 * frame, backwards);
    EXPECT_EQ(cursor.announcement(cursor.next()->event), "a");
  }
  execute(path, "UPDATE event SET value = 'd' WHERE value = 'a'");
  std::uint64_t damaged = 0;
  EXPECT_EQ(announced(path, &damaged), (std::vector<std::string>{"none", "", "", "c", "c"}));
  EXPECT_EQ(damaged, 2u);
}

// They have no table of announcements and no second place for formats.
TEST_F(Takes, OlderTakesAreReadAndAddedTo) {
  {
    TakeWriter take(path, Existing::refuse);
    write(take, 1, 0, 2);
  }
  execute(path, "DROP TABLE event; DROP INDEX format_by_caps");
  EXPECT_EQ(announced(path), (std::vector<std::string>{"none", "none"}));
  {
    TakeWriter take(path, Existing::append);
    take.announce(take.stream("cam0"), "a");
    write(take, 1, 0, 1);
  }
  EXPECT_EQ(announced(path), (std::vector<std::string>{"none", "none", "a"}));
}

// With the packets of the transaction that fails.
TEST_F(Takes, WhatAFullDiskHasTakenIsAnnouncedAgain) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  TakeWriter take(path, Existing::refuse);
  write(take, 1, 0, 2);
  take.announce(take.stream("cam0"), "a");
  write(take, 1, 2, 3, 500'000);
  rlimit small = before;
  small.rlim_cur = 300'000;
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write(take, 1, 3, 4), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_DFL);
  write(take, 1, 4, 5);
  take.finish();
  EXPECT_EQ(announced(path), (std::vector<std::string>{"none", "none", "a"}));
}

TEST_F(Takes, WhatIsNoTakeIsRefusedInWords) {
  const auto message = [](auto&& body) -> std::string {
    try {
      body();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const auto has = [&](const std::string& text, const char* what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  has(message([&] { read_take(path); }), "No such file");
  has(message([&] { read_take(folder.path); }), "no file");
  has(message([&] { TakeWriter(folder.file("none/x.take"), Existing::replace); }), "no folder");
  std::ofstream(path) << std::string(10'000, 'x');
  has(message([&] { read_take(path); }), "no take");
  has(message([&] { TakeWriter(path, Existing::append); }), "no take");
  has(message([&] { TakeWriter(path, Existing::replace); }), "no take");
  EXPECT_EQ(std::filesystem::file_size(path), 10'000u);  // another's file is not overwritten
  std::filesystem::remove(path);
  sqlite3* other = nullptr;
  sqlite3_open(path.c_str(), &other);
  sqlite3_exec(other, "CREATE TABLE a (b)", nullptr, nullptr, nullptr);
  sqlite3_close(other);
  has(message([&] { read_take(path); }), "another program's");
  has(message([&] { TakeWriter(path, Existing::replace); }), "another program's");
  std::filesystem::remove(path);
  { TakeWriter take(path, Existing::refuse); }
  // A table that is never at its end.
  sqlite3_open(path.c_str(), &other);
  sqlite3_exec(
      other,
      "DROP TABLE stream; CREATE VIEW stream AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL "
      "SELECT id + 1 FROM n) SELECT id, 'a' AS name FROM n",
      nullptr, nullptr, nullptr);
  sqlite3_close(other);
  has(message([&] { read_take(path); }), "views, triggers");
  std::filesystem::remove(path);
  { TakeWriter take(path, Existing::refuse); }
  EXPECT_TRUE(read_take(path).streams.empty());
  has(message([&] { TakeWriter(path, Existing::refuse); }), "there already");
  sqlite3_open(path.c_str(), &other);
  sqlite3_exec(other, "PRAGMA user_version = 9", nullptr, nullptr, nullptr);
  sqlite3_close(other);
  has(message([&] { read_take(path); }), "version 9");
  TakeWriter again(path + "2", Existing::replace);
  has(message([&] { again.write(1, {"", -5, 0, 0, {}}, {}); }), "-5 ns");
}

}  // namespace
}  // namespace polyhull
