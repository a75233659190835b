// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Reads a take (take.h).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "take/database.h"
#include "take/formats.h"
#include "take/packing.h"
#include "take/take.h"

namespace polyhull {

/// What a take holds.
struct TakeContent {
  std::vector<TakeStream> streams;
  std::vector<TakeNote> notes;
  std::int64_t end = 0;  ///< of the longest stream, ns
};

/// What is damaged of the lists of streams and notes is left out, or found by the packets. Throws
/// Error: not_found, io, bad_input (no take, or damaged where its tables are listed), unsupported
/// (another version).
TakeContent read_take(const std::string& path);

/// The packets of one stream, one after the other. Each has its own connection to the file: streams
/// can be read by different threads, one thread for each.
class TakeCursor {
 public:
  /// Throws as read_take() does.
  TakeCursor(const std::string& path, std::int64_t stream);
  TakeCursor(const TakeCursor&) = delete;  // its statements know where its database is
  TakeCursor& operator=(const TakeCursor&) = delete;

  /// The next packet is the first whose time is \p time or later, ns; \p backwards: next() goes
  /// back in time from the last one whose time is \p time or earlier.
  void seek(std::int64_t time, bool backwards = false);

  /// The next packet; none: there are no more. Packets that are damaged, or packed behind one that
  /// is, are left out and counted.
  /// Throws Error (io) where the file cannot be read at all.
  std::optional<TakePacket> next();

  /// Time, duration and flags of the next packet, which stays the next one: nothing else is read, held
  /// against a checksum or unpacked.
  std::optional<TakePacket> peek();

  /// The announcement (take.h) that TakePacket::event stands for; empty where it is damaged.
  std::string announcement(std::int64_t event);

  std::uint64_t damaged() const { return damaged_; }

 private:
  struct Place {
    std::int64_t id, time;
  };
  static TakeDatabase checked(const std::string& path);
  std::optional<Place> place();
  std::optional<TakePacket> fetch(const Place& place);
  bool fetch_stored(std::int64_t id, TakePacket& packet, bool& packed);
  bool unpack(std::int64_t id, TakePacket& packet);
  void keep(std::int64_t id, std::vector<std::uint8_t> unpacked);
  std::int64_t event_of(std::int64_t id);

  TakeDatabase database_;
  TakeStatement after_, before_, row_, head_, by_id_, by_id_back_;
  TakeFormats formats_;
  std::optional<TakeStatement> event_of_, event_;  // older takes have none
  std::int64_t stream_;
  std::int64_t last_id_ = 0;  // of all packets
  Place at_{-1, -1};          // of the last packet told
  bool backwards_ = false;
  bool without_index_ = false;  // it is damaged: packets are taken in the order written
  std::uint64_t damaged_ = 0;
  PacketUnpacker unpacker_;
  // Going back: what was unpacked on the way to a packet comes next.
  std::map<std::int64_t, std::vector<std::uint8_t>> kept_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace polyhull
