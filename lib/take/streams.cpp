// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/streams.h"

#include <algorithm>

#include "base/error.h"

namespace polyhull {

std::vector<TakeStream> read_streams(TakeDatabase& database) {
  std::vector<TakeStream> streams;
  // Of packets only the index is read, but for one of each stream: an hour of them is far more than
  // memory.
  TakeStatement all(database, "SELECT id, name FROM stream ORDER BY id");
  while (all.step()) streams.push_back({all.number(0), all.text(1)});
  for (TakeStream& stream : streams) {
    TakeStatement ends(database,
                       "SELECT min(time), max(time) FROM packet INDEXED BY packet_by_time "
                       "WHERE stream = ?");
    ends.bind(stream.id).step();
    stream.begin = ends.number(0);
    stream.end = ends.number(1);
    try {
      TakeStatement last(database,
                         "SELECT duration FROM packet WHERE stream = ? AND time = ? "
                         "ORDER BY id DESC LIMIT 1");
      if (last.bind(stream.id).bind(stream.end).step())
        stream.end += std::max<std::int64_t>(0, last.number(0));
    } catch (const Error&) {
      // Damaged; its begin is known.
    }
  }
  return streams;
}

}  // namespace polyhull
