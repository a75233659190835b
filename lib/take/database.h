// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// SQLite's handles as C++ values, with errors as sentences.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace polyhull {

class TakeDatabase;

/// How long who finds a take locked waits for who locks it.
inline constexpr int take_wait_ms = 2000;

/// One prepared statement. Throws Error (io, bad_input for a damaged file) wherever SQLite fails.
class TakeStatement {
 public:
  TakeStatement() = default;
  TakeStatement(TakeDatabase& database, const char* sql);

  /// Gives the next parameter its value; bytes and texts must last until reset().
  TakeStatement& bind(std::int64_t value);
  TakeStatement& bind(std::string_view text);
  TakeStatement& bind(std::span<const std::uint8_t> bytes);

  /// The next row; false: there is none.
  bool step();
  /// Carries out a statement without rows, and makes it ready for the next time.
  void run();
  /// Ready for the next time.
  void reset();

  std::int64_t number(int column) const;
  std::string text(int column) const;
  /// Lasts until the next step() or reset().
  std::span<const std::uint8_t> bytes(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  TakeDatabase* database_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  int bound_ = 0;
};

/// One open file.
class TakeDatabase {
 public:
  enum class For { reading, writing };
  /// Throws Error (not_found, io, bad_input) where \p path is no file that SQLite can open.
  TakeDatabase(const std::string& path, For what);

  void execute(const char* sql);
  sqlite3* handle() const { return handle_.get(); }
  const std::string& path() const { return path_; }
  /// Throws the Error that tells SQLite's \p code, which \p doing ("write", "read") gave.
  [[noreturn]] void fail_with(int code, const char* doing) const;

 private:
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  void read_what_there_is();

  std::string path_;
  For for_;
  std::unique_ptr<sqlite3, Close> handle_;
};

/// "PHTK", and the numbers of the layout: without and with packed packets.
inline constexpr std::int64_t take_application = 0x5048544b, take_version = 1,
                              packed_take_version = 2;

/// Throws Error (bad_input, unsupported) where \p database is no take of a version that is known.
void check_take(TakeDatabase& database);

}  // namespace polyhull
