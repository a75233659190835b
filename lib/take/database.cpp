// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/database.h"

#include <sqlite3.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "base/error.h"

namespace polyhull {

void TakeStatement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

void TakeDatabase::Close::operator()(sqlite3* handle) const {
  sqlite3_close(handle);
}

TakeDatabase::TakeDatabase(const std::string& path, For what) : path_(path), for_(what) {
  struct stat status {};
  const bool there = stat(path.c_str(), &status) == 0;
  if (!there && (what == For::reading || errno != ENOENT))
    throw Error(errno == ENOENT ? Error::Kind::not_found : Error::Kind::io,
                "The take '{}' cannot be opened: {}. Check location.", path, std::strerror(errno));
  if (there && !S_ISREG(status.st_mode))
    throw Error(Error::Kind::io,
                "The take '{}' cannot be opened: it is no file. Set location to the name of one.",
                path);
  sqlite3* handle = nullptr;
  // A reader, too, opens for writing where it may: only so can what a killed writer has left be made
  // good.
  int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;
  if (what == For::writing) flags |= SQLITE_OPEN_CREATE;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) fail_with(code, "opened");
  sqlite3_extended_result_codes(handle, 1);
  // A writer that waits for a slow reader lets nobody else begin to read.
  sqlite3_busy_timeout(handle, what == For::reading ? 5 * take_wait_ms : take_wait_ms);
  // A take's own tables are all that is asked, whatever else a file says.
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  if (what == For::reading) read_what_there_is();
  // Blobs are larger than any cache that would be of use.
  execute("PRAGMA cache_size = -4096");
}

/// Of a file that is cut off SQLite reads the tables only where it is told to take them as they are.
void TakeDatabase::read_what_there_is() {
  const char* any = "SELECT count(*) FROM sqlite_master";
  const int code = sqlite3_exec(handle(), any, nullptr, nullptr, nullptr);
  if ((code & 0xff) == SQLITE_CORRUPT) execute("PRAGMA writable_schema = ON");
}

void TakeDatabase::fail_with(int code, const char* doing) const {
  const int kind = code & 0xff;
  if (kind == SQLITE_FULL || (kind == SQLITE_IOERR && (errno == ENOSPC || errno == EFBIG)))
    throw Error(Error::Kind::io,
                "The take '{}' cannot be {}: the disk is full. What was written before stays "
                "readable; make room, or set location to another disk.",
                path_, doing);
  if (kind == SQLITE_NOTADB)
    throw Error(Error::Kind::bad_input,
                "'{}' is no take: it is no SQLite database. Set location to a file that takesink "
                "wrote.",
                path_);
  if (kind == SQLITE_CORRUPT)
    throw Error(Error::Kind::bad_input,
                "The take '{}' is damaged where it was to be {}. Try 'polyhull-take recover'.",
                path_, doing);
  if (kind == SQLITE_BUSY || kind == SQLITE_LOCKED)
    throw Error(Error::Kind::io,
                "The take '{}' cannot be {}: another program or element reads or writes it.", path_,
                doing);
  const int system = sqlite3_system_errno(handle_.get());
  throw Error(Error::Kind::io, "The take '{}' cannot be {}: {}{}{}.", path_, doing,
              sqlite3_errmsg(handle_.get()), system != 0 ? ", " : "",
              system != 0 ? std::strerror(system) : "");
}

void TakeDatabase::execute(const char* sql) {
  const int code = sqlite3_exec(handle(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail_with(code, for_ == For::writing ? "written" : "read");
}

TakeStatement::TakeStatement(TakeDatabase& database, const char* sql) : database_(&database) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(database.handle(), sql, -1, SQLITE_PREPARE_PERSISTENT,
                                      &statement, nullptr);
  statement_.reset(statement);
  if (code != SQLITE_OK) database.fail_with(code, "read");
}

TakeStatement& TakeStatement::bind(std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), ++bound_, value);
  return *this;
}

TakeStatement& TakeStatement::bind(std::string_view text) {
  sqlite3_bind_text64(statement_.get(), ++bound_, text.data(), text.size(), SQLITE_STATIC,
                      SQLITE_UTF8);
  return *this;
}

TakeStatement& TakeStatement::bind(std::span<const std::uint8_t> bytes) {
  const int code =
      sqlite3_bind_blob64(statement_.get(), ++bound_,
                          bytes.empty() ? reinterpret_cast<const std::uint8_t*>("") : bytes.data(),
                          bytes.size(), SQLITE_STATIC);
  if (code == SQLITE_TOOBIG)
    throw Error(Error::Kind::unsupported,
                "A buffer of {} bytes is too large for the take '{}', which takes up to a thousand "
                "million.",
                bytes.size(), database_->path());
  if (code != SQLITE_OK) database_->fail_with(code, "written");
  return *this;
}

bool TakeStatement::step() {
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  sqlite3_reset(statement_.get());
  database_->fail_with(code, sqlite3_stmt_readonly(statement_.get()) != 0 ? "read" : "written");
}

void TakeStatement::run() {
  const bool row = step();
  reset();
  if (row) throw Error(Error::Kind::bad_input, "The take '{}' is damaged.", database_->path());
}

void TakeStatement::reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
  bound_ = 0;
}

std::int64_t TakeStatement::number(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string TakeStatement::text(int column) const {
  const auto* text = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return text == nullptr
             ? std::string()
             : std::string(reinterpret_cast<const char*>(text), static_cast<std::size_t>(size));
}

std::span<const std::uint8_t> TakeStatement::bytes(int column) const {
  const auto* data =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return {data, data == nullptr ? 0 : static_cast<std::size_t>(size)};
}

void check_take(TakeDatabase& database) {
  const auto pragma = [&](const char* sql) {
    TakeStatement statement(database, sql);
    return statement.step() ? statement.number(0) : 0;
  };
  if (pragma("PRAGMA application_id") != take_application)
    throw Error(Error::Kind::bad_input,
                "'{}' is no take: it is another program's database. Set location to a file that "
                "takesink wrote.",
                database.path());
  const std::int64_t version = pragma("PRAGMA user_version");
  if (version != take_version && version != packed_take_version)
    throw Error(Error::Kind::unsupported,
                "The take '{}' has version {}, and this build reads versions {} and {}. Use the "
                "polyhull that wrote it, or a newer one.",
                database.path(), version, take_version, packed_take_version);
  std::int64_t others = 0;
  try {
    others = pragma(
        "SELECT count(*) FROM sqlite_master WHERE type NOT IN ('table', 'index') OR "
        "sql LIKE '%virtual%'");
    // A computed column makes gigabytes of a small file.
    others += pragma(
        "SELECT count(*) FROM sqlite_master AS m, pragma_table_xinfo(m.name) AS c "
        "WHERE m.type = 'table' AND c.hidden <> 0");
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;  // damaged: what can be read, is
  }
  if (others != 0)
    throw Error(
        Error::Kind::bad_input,
        "'{}' is no take: it has views, triggers, virtual tables or computed columns, which "
        "takesink never makes. Set location to a file that takesink wrote.",
        database.path());
}

}  // namespace polyhull
