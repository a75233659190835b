// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/streams.h"

#include <algorithm>
#include <string>

#include "base/error.h"

namespace polyhull {

namespace {

/// More are no writer's: each has a thread and a connection of its own.
constexpr std::size_t most_streams = 256;

/// What lasts longer, ns, is damaged: what is appended must not begin in a thousand years.
constexpr std::int64_t longest_duration = 3'600'000'000'000;

/// Those that packets name, where the streams' own table cannot be read.
std::vector<TakeStream> streams_of_packets(TakeDatabase& database) {
  std::vector<TakeStream> streams;
  try {
    TakeStatement all(database, "SELECT DISTINCT stream FROM packet NOT INDEXED ORDER BY stream");
    while (all.step())
      streams.push_back({all.number(0), "sink_" + std::to_string(all.number(0) - 1)});
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
  }
  return streams;
}

/// Its begin and end by \p sql; false where that cannot be read.
bool read_ends(TakeDatabase& database, const char* sql, TakeStream& stream) {
  try {
    TakeStatement ends(database, sql);
    ends.bind(stream.id).step();
    stream.begin = std::clamp<std::int64_t>(ends.number(0), 0, largest_take_time);
    stream.end = std::clamp<std::int64_t>(ends.number(1), 0, largest_take_time);
    return true;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
    return false;
  }
}

}  // namespace

std::vector<TakeStream> read_streams(TakeDatabase& database) {
  std::vector<TakeStream> streams;
  // Of packets only the index is read, but for one of each stream: an hour of them is far more than
  // memory.
  try {
    TakeStatement all(database, "SELECT id, name FROM stream ORDER BY id");
    while (all.step()) streams.push_back({all.number(0), all.text(1)});
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
    streams = streams_of_packets(database);
  }
  if (streams.size() > most_streams)
    throw Error(Error::Kind::unsupported,
                "The take '{}' has {} streams, of which {} can be played. Was it damaged?",
                database.path(), streams.size(), most_streams);
  for (TakeStream& stream : streams) {
    if (!read_ends(database,
                   "SELECT min(time), max(time) FROM packet INDEXED BY packet_by_time "
                   "WHERE stream = ?",
                   stream))
      read_ends(database, "SELECT min(time), max(time) FROM packet NOT INDEXED WHERE stream = ?",
                stream);
    try {
      TakeStatement last(database,
                         "SELECT duration FROM packet WHERE stream = ? AND time = ? "
                         "ORDER BY id DESC LIMIT 1");
      if (last.bind(stream.id).bind(stream.end).step())
        if (last.number(0) > 0 && last.number(0) <= longest_duration) stream.end += last.number(0);
    } catch (const Error&) {
      // Damaged; its begin is known.
    }
  }
  return streams;
}

}  // namespace polyhull
