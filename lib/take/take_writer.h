// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Writes a take (take.h).
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "take/database.h"
#include "take/take.h"

namespace polyhull {

/// For one thread at a time.
class TakeWriter {
  /// Keeps a file from being written by anybody else for as long as this lives.
  class Claim {
   public:
    /// Throws Error (io) where another writer has it.
    explicit Claim(const std::string& path);
    ~Claim();
    Claim(const Claim&) = delete;

   private:
    int file_;
  };

 public:
  enum class Existing {
    replace,  ///< a take that is there is overwritten; a file that is no take is not
    append,   ///< what comes is put behind what is there, on streams of the same names
    refuse,
  };
  /// Opens \p path, and makes good what a killed writer has left there. Throws Error: not_found (no
  /// such folder), io (so where another program or element writes it), bad_input (another kind of
  /// file; Existing::refuse and there is one).
  TakeWriter(const std::string& path, Existing existing);
  /// As finish(), without errors.
  ~TakeWriter();
  TakeWriter(const TakeWriter&) = delete;
  TakeWriter& operator=(const TakeWriter&) = delete;

  /// Where what is written next begins: 0, or the end of what was there, whose last packets last as
  /// long as those before them, or 40 ms, where they do not say.
  std::int64_t begin() const { return begin_; }

  /// Keeps \p value under \p name, in the place of what was there.
  void note(const std::string& name, const std::string& value);

  /// The stream \p name, made where it is not there.
  std::int64_t stream(const std::string& name);

  /// Writes a packet of \p stream; TakePacket::data does not count, \p data does, and times are from
  /// begin() on. Commits the packets before where this one is of another instant (10 ms and more), or
  /// where they wait for a second or are 64 MiB; while others read the file they wait for longer.
  /// \p packed: \p data is what a PacketPacker made of it. Returns its id, above 0, by which packets
  /// can be packed behind it. Throws Error: io: the disk is full, or gone; the packets that were
  /// committed stay readable, and nothing may be packed behind what was written before; bad_input: it
  /// is packed behind another packet than the stream's last.
  std::int64_t write(std::int64_t stream, const TakePacket& packet,
                     std::span<const std::uint8_t> data, bool packed = false);

  /// The id of the last packet of \p stream, if that was packed and nothing has taken it away since:
  /// another may be packed behind it. 0: none.
  std::int64_t last_packed(std::int64_t stream) const;

  /// What is written of \p stream from now on was announced by \p json: it is kept with the next packet.
  void announce(std::int64_t stream, std::string json);

  /// Commits what there is. False: others read the file, and did so for \p wait_ms; it is tried again
  /// with what is written next. Throws Error (io): the disk is full, or gone.
  bool commit(int wait_ms = take_wait_ms);
  /// The last commit was held up by who reads the file.
  bool held_up() const { return held_up_; }
  /// Commits and closes. Throws Error (io) as commit() does, and where others have read the file for
  /// \p wait_ms: what was not committed is given up then.
  void finish(int wait_ms = 10'000);

  std::uint64_t bytes() const { return bytes_; }  ///< of all packets written

 private:
  struct Stream {
    std::string name;
    std::pair<std::string, std::int64_t> format;  // the last, and its id
    std::int64_t packed = 0;                      // the last packet, if it is packed
    std::string announcement;
    bool announced = false;  // it is in the file
  };
  std::int64_t format(std::int64_t stream, const std::string& caps);
  void tell_packed();
  void make_streams_again();
  void write_announcement(std::int64_t stream, std::int64_t packet);
  bool in_transaction() const;
  void begin_transaction(std::int64_t time);
  void commit_if_due(std::int64_t time);
  void roll_back();
  void forget();

  static TakeDatabase open(const std::string& path, Existing existing, std::optional<Claim>& claim);

  // Before the database: where a file is closed, the locks that SQLite has on it are gone.
  std::optional<Claim> claim_;
  TakeDatabase database_;
  TakeStatement insert_;
  std::map<std::int64_t, Stream> streams_;  // by id
  bool streams_lost_ = false;               // some may have to be made again
  std::int64_t begin_ = 0;
  std::uint64_t bytes_ = 0;
  // Of the transaction that is open:
  std::int64_t instant_ = 0;                     // of which it was last
  std::chrono::steady_clock::time_point tried_;  // when it began, or was last tried to be committed
  std::uint64_t pending_ = 0,
                tried_bytes_ = 0;  // bytes of its packets, and of those that were tried
  bool held_up_ = false;
  bool told_packed_ = false;  // the file says that it has packed packets
};

}  // namespace polyhull
