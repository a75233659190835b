// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/take_writer.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "base/error.h"
#include "take/packet_hash.h"
#include "take/packing.h"
#include "take/streams.h"

namespace polyhull {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::int64_t same_instant = 10'000'000;  // ns

// Whatever the times say, what is not committed is gone with a killed writer, and in memory.
constexpr auto longest_transaction = std::chrono::seconds(1);
constexpr std::uint64_t largest_transaction = 64u << 20;

// How long a commit waits for those who read the file just now, ms: a moment, as what comes next can
// be committed with it; a second where there is so much that it should not become more.
constexpr int short_wait = 20, long_wait = 1000;
constexpr std::uint64_t too_much = 1u << 30;

// A journal of what pages were before, not of what they become: new pages need none, so that pixels
// are written once. Without waiting for the disk a killed process loses nothing that was committed
// (the system has it), a machine without power can. What is not committed stays in memory: were it
// written before, nobody could read until the commit.
constexpr char set_up[] =
    "PRAGMA journal_mode = TRUNCATE;"
    "PRAGMA synchronous = OFF;"
    "PRAGMA cache_spill = OFF;";

constexpr char tables[] =
    "PRAGMA application_id = 1346917451;"  // take_application
    "PRAGMA user_version = 1;"
    "CREATE TABLE stream (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);"
    "CREATE TABLE format (id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, caps TEXT NOT NULL);"
    "CREATE TABLE packet (id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, format INTEGER NOT NULL,"
    "  time INTEGER NOT NULL, duration INTEGER NOT NULL, flags INTEGER NOT NULL,"
    "  hash INTEGER NOT NULL, data BLOB NOT NULL);"
    "CREATE INDEX packet_by_time ON packet (stream, time);"
    "CREATE TABLE note (name TEXT PRIMARY KEY, value TEXT NOT NULL);";
static_assert(take_application == 1346917451 && take_version == 1);

// Older takes have none of these. The index is a second place for what the packets are (formats.h).
constexpr char later_tables[] =
    "CREATE INDEX IF NOT EXISTS format_by_caps ON format (stream, caps);"
    "CREATE TABLE IF NOT EXISTS event (id INTEGER PRIMARY KEY, stream INTEGER NOT NULL,"
    "  packet INTEGER NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, hash INTEGER NOT NULL);"
    "CREATE INDEX IF NOT EXISTS event_by_packet ON event (stream, packet);";

/// Where \p stream ends, with a last packet that says of itself how long it lasts, or lasts as long as
/// the one before it did, or 40 ms.
std::int64_t whole_end(TakeDatabase& database, const TakeStream& stream) {
  constexpr std::int64_t usual = 40'000'000, longest = 1'000'000'000;
  try {
    TakeStatement last(database,
                       "SELECT time FROM packet INDEXED BY packet_by_time WHERE stream = ? "
                       "ORDER BY time DESC LIMIT 2");
    if (!last.bind(stream.id).step() || last.number(0) < stream.end) return stream.end;
    const std::int64_t before = last.step() ? last.number(0) : stream.end;
    const std::int64_t lasted = stream.end - before;
    return stream.end + (lasted > 0 && lasted <= longest ? lasted : usual);
  } catch (const Error&) {
    return stream.end + usual;  // damaged
  }
}

}  // namespace

TakeWriter::Claim::Claim(const std::string& path)
    : file_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  // Why it cannot be opened is SQLite's to say.
  if (file_ < 0 || flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(file_);
  throw Error(Error::Kind::io,
              "The take '{}' cannot be written: another program or element writes it.", path);
}

TakeWriter::Claim::~Claim() {
  if (file_ >= 0) close(file_);
}

TakeDatabase TakeWriter::open(const std::string& path, Existing existing,
                              std::optional<Claim>& claim) {
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw Error(
        Error::Kind::not_found,
        "The take '{}' cannot be written: there is no folder '{}'. Make it, or set location "
        "to another one.",
        path, folder.string());
  std::error_code ignored;
  const bool there = std::filesystem::is_regular_file(path, ignored) &&
                     std::filesystem::file_size(path, ignored) > 0;
  if (there) {
    if (existing == TakeWriter::Existing::refuse)
      throw Error(Error::Kind::bad_input,
                  "'{}' is there already. Name another file, or set existing=append or "
                  "existing=replace.",
                  path);
    claim.emplace(path);
    TakeDatabase old(path, TakeDatabase::For::writing);
    try {
      check_take(old);
    } catch (const Error& error) {
      throw Error(error.kind(), "{} Nothing was written.", error.what());
    }
    if (existing == TakeWriter::Existing::append) return old;
  }
  if (there) {
    std::filesystem::remove(path, ignored);
    std::filesystem::remove(path + "-journal", ignored);
  }
  claim.reset();
  claim.emplace(path);
  return TakeDatabase(path, TakeDatabase::For::writing);
}

TakeWriter::TakeWriter(const std::string& path, Existing existing)
    : database_(open(path, existing, claim_)) {
  const bool fresh = [&] {
    TakeStatement any(database_, "SELECT count(*) FROM sqlite_master");
    return any.step() && any.number(0) == 0;
  }();
  if (fresh) database_.execute("PRAGMA page_size = 32768");
  database_.execute(set_up);
  if (fresh) {
    database_.execute("BEGIN");
    database_.execute(tables);
    database_.execute(later_tables);
    database_.execute("COMMIT");
  } else {
    database_.execute(later_tables);
    for (const TakeStream& stream : read_streams(database_))
      begin_ = std::max(begin_, whole_end(database_, stream));
  }
  insert_ =
      TakeStatement(database_,
                    "INSERT INTO packet (stream, format, time, duration, flags, hash, data) VALUES "
                    "(?, ?, ?, ?, ?, ?, ?)");
}

TakeWriter::~TakeWriter() {
  try {
    finish();
  } catch (const std::exception&) {
    // Who wants to know calls finish().
  }
}

bool TakeWriter::in_transaction() const {
  return sqlite3_get_autocommit(database_.handle()) == 0;
}

bool TakeWriter::commit(int wait_ms) {
  if (!in_transaction()) return true;
  sqlite3_busy_timeout(database_.handle(), wait_ms);
  const int code = sqlite3_exec(database_.handle(), "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_busy_timeout(database_.handle(), take_wait_ms);
  tried_ = Clock::now();
  tried_bytes_ = pending_;
  held_up_ = (code & 0xff) == SQLITE_BUSY;
  if (held_up_) return false;
  if (code == SQLITE_OK) return true;
  try {
    database_.fail_with(code, "written");
  } catch (const Error&) {
    roll_back();
    throw;
  }
}

/// Where packets of \p time begin another instant, and where the transaction is old or large.
void TakeWriter::commit_if_due(std::int64_t time) {
  if (!in_transaction()) return;
  if (std::abs(time - instant_) < same_instant && Clock::now() - tried_ < longest_transaction &&
      pending_ - tried_bytes_ < largest_transaction)
    return;
  // Once it was held up nobody else begins to read before it: those who do are waited for.
  commit(pending_ >= too_much ? long_wait : held_up_ ? 0 : short_wait);
  instant_ = time;
}

void TakeWriter::begin_transaction(std::int64_t time) {
  if (in_transaction()) return;
  database_.execute("BEGIN");
  instant_ = time;
  tried_ = Clock::now();
  pending_ = tried_bytes_ = 0;
}

void TakeWriter::roll_back() {
  forget();
  held_up_ = false;
  try {
    if (in_transaction()) database_.execute("ROLLBACK");
  } catch (const Error&) {
    // SQLite has done it.
  }
}

void TakeWriter::finish(int wait_ms) {
  if (!commit(wait_ms)) {
    const double lost = 1e-6 * static_cast<double>(pending_);
    roll_back();
    throw Error(
        Error::Kind::io,
        "The last {:.1f} MB of the take '{}' could not be written: another program has been "
        "reading it for longer than {:.3g} s. What was written before stays.",
        lost, database_.path(), 1e-3 * wait_ms);
  }
  // Takes the empty journal away: a take is one file.
  database_.execute("PRAGMA journal_mode = DELETE");
}

void TakeWriter::note(const std::string& name, const std::string& value) {
  TakeStatement(database_, "INSERT OR REPLACE INTO note (name, value) VALUES (?, ?)")
      .bind(std::string_view(name))
      .bind(std::string_view(value))
      .run();
}

std::int64_t TakeWriter::stream(const std::string& name) {
  make_streams_again();
  TakeStatement(database_, "INSERT OR IGNORE INTO stream (name) VALUES (?)")
      .bind(std::string_view(name))
      .run();
  TakeStatement found(database_, "SELECT id FROM stream WHERE name = ?");
  found.bind(std::string_view(name));
  if (!found.step()) throw Error(Error::Kind::bad_input, "The take's table of streams is damaged.");
  streams_[found.number(0)].name = name;
  return found.number(0);
}

/// Those that were made in a transaction that is gone, under the ids that were told.
void TakeWriter::make_streams_again() {
  if (!streams_lost_) return;
  for (const auto& [id, stream] : streams_)
    if (!stream.name.empty())
      TakeStatement(database_, "INSERT OR IGNORE INTO stream (id, name) VALUES (?, ?)")
          .bind(id)
          .bind(std::string_view(stream.name))
          .run();
  streams_lost_ = false;
}

std::int64_t TakeWriter::last_packed(std::int64_t stream) const {
  const auto found = streams_.find(stream);
  return found == streams_.end() ? 0 : found->second.packed;
}

void TakeWriter::announce(std::int64_t stream, std::string json) {
  Stream& of = streams_[stream];
  if (of.announcement == json) return;
  of.announcement = std::move(json);
  of.announced = false;
}

/// With the packet from which on it is true: of both or none is read.
void TakeWriter::write_announcement(std::int64_t stream, std::int64_t packet) {
  Stream& of = streams_[stream];
  if (of.announced || of.announcement.empty()) return;
  TakeStatement(database_,
                "INSERT INTO event (stream, packet, name, value, hash) VALUES (?, ?, ?, ?, ?)")
      .bind(stream)
      .bind(packet)
      .bind(std::string_view(take_announcement))
      .bind(std::string_view(of.announcement))
      .bind(event_hash(packet, of.announcement))
      .run();
  of.announced = true;
}

std::int64_t TakeWriter::format(std::int64_t stream, const std::string& caps) {
  auto& [known, id] = streams_[stream].format;
  if (id != 0 && known == caps) return id;
  TakeStatement found(database_, "SELECT id FROM format WHERE stream = ? AND caps = ?");
  found.bind(stream).bind(std::string_view(caps));
  if (found.step()) {
    id = found.number(0);
  } else {
    TakeStatement(database_, "INSERT INTO format (stream, caps) VALUES (?, ?)")
        .bind(stream)
        .bind(std::string_view(caps))
        .run();
    TakeStatement made(database_, "SELECT last_insert_rowid()");
    made.step();
    id = made.number(0);
  }
  known = caps;
  return id;
}

/// What was written in this transaction may be gone, and its ids another's.
void TakeWriter::forget() {
  for (auto& [id, stream] : streams_) {
    stream.format = {};
    stream.packed = 0;
    stream.announced = false;
  }
  told_packed_ = false;
  streams_lost_ = true;
}

/// Within the transaction of the first of them: older readers must not take it for what it is not.
void TakeWriter::tell_packed() {
  if (told_packed_) return;
  database_.execute("PRAGMA user_version = 2");
  static_assert(packed_take_version == 2);
  told_packed_ = true;
}

std::int64_t TakeWriter::write(std::int64_t stream, const TakePacket& packet,
                               std::span<const std::uint8_t> data, bool packed) {
  if (packet.time < 0 || packet.time > largest_take_time)
    throw Error(Error::Kind::bad_input, "A packet of a take has the time {} ns.", packet.time);
  if (packed) {
    const std::int64_t before = PacketUnpacker::before(data);
    if (before != 0 && last_packed(stream) != before)
      throw Error(Error::Kind::bad_input,
                  "A packet of a take is packed behind another than its stream's last.");
  }
  const std::int64_t time = begin_ + packet.time;
  commit_if_due(time);
  begin_transaction(time);
  std::int64_t id = 0;
  try {
    make_streams_again();
    if (packed) tell_packed();
    const std::int64_t of_format = format(stream, packet.caps);
    insert_.bind(stream)
        .bind(of_format)
        .bind(time)
        .bind(packet.duration)
        .bind(static_cast<std::int64_t>(packet.flags) | (packed ? packed_flag : 0))
        .bind(packet_hash(time, data, packet, packed))
        .bind(data)
        .run();
    id = sqlite3_last_insert_rowid(database_.handle());
    write_announcement(stream, id);
  } catch (const Error&) {
    insert_.reset();
    forget();
    try {
      // The packets of this instant that were written before stay, if they can.
      commit(short_wait);
    } catch (const Error&) {
      // Then they do not; what was committed before does.
    }
    throw;
  }
  bytes_ += data.size();
  pending_ += data.size();
  streams_[stream].packed = packed ? id : 0;
  return id;
}

}  // namespace polyhull
