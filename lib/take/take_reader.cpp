// SPDX-License-Identifier: LGPL-2.1-or-later
#include "take/take_reader.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.h"
#include "take/packet_hash.h"
#include "take/streams.h"

namespace polyhull {
namespace {

/// Packets one after the other that cannot be read; then nothing is looked for any more.
constexpr int most_unreadable = 1'000'000;

/// Of what was unpacked for one packet: packed, in memory at once, and kept for those before it.
constexpr std::size_t largest_chain = std::size_t{1} << 30, most_kept = 64 << 20;

}  // namespace

TakeContent read_take(const std::string& path) {
  TakeDatabase database(path, TakeDatabase::For::reading);
  check_take(database);
  TakeContent content;
  content.streams = read_streams(database);
  for (const TakeStream& stream : content.streams) content.end = std::max(content.end, stream.end);
  try {
    TakeStatement notes(database, "SELECT name, value FROM note NOT INDEXED");
    while (notes.step()) content.notes.push_back({notes.text(0), notes.text(1)});
  } catch (const Error& error) {
    // Damaged; those that came before are whole.
    if (error.kind() != Error::Kind::bad_input) throw;
  }
  std::sort(content.notes.begin(), content.notes.end(),
            [](const TakeNote& a, const TakeNote& b) { return a.name < b.name; });
  return content;
}

/// The file, if it is a take.
TakeDatabase TakeCursor::checked(const std::string& path) {
  TakeDatabase database(path, TakeDatabase::For::reading);
  check_take(database);
  return database;
}

TakeCursor::TakeCursor(const std::string& path, std::int64_t stream)
    : database_(checked(path)), formats_(database_, stream), stream_(stream) {
  after_ = TakeStatement(database_,
                         "SELECT id, time FROM packet INDEXED BY packet_by_time "
                         "WHERE stream = ? AND (time, id) > (?, ?) ORDER BY time, id LIMIT 1");
  before_ = TakeStatement(database_,
                          "SELECT id, time FROM packet INDEXED BY packet_by_time "
                          "WHERE stream = ? AND (time, id) < (?, ?) "
                          "ORDER BY time DESC, id DESC LIMIT 1");
  row_ = TakeStatement(database_,
                       "SELECT time, duration, flags, hash, data, format, stream FROM packet "
                       "WHERE id = ?");
  head_ = TakeStatement(database_, "SELECT duration, flags FROM packet WHERE id = ?");
  by_id_ = TakeStatement(database_,
                         "SELECT id, time FROM packet NOT INDEXED WHERE stream = ? AND id >= ? "
                         "ORDER BY id LIMIT 1");
  by_id_back_ = TakeStatement(database_,
                              "SELECT id, time FROM packet NOT INDEXED WHERE stream = ? AND "
                              "id <= ? ORDER BY id DESC LIMIT 1");
  try {
    event_of_.emplace(database_,
                      "SELECT id FROM event INDEXED BY event_by_packet WHERE stream = ? AND "
                      "packet <= ? AND name = ? ORDER BY packet DESC, id DESC LIMIT 1");
    event_.emplace(database_, "SELECT value, hash, packet FROM event WHERE id = ?");
  } catch (const Error&) {
    event_of_.reset();
  }
  try {
    TakeStatement last(database_, "SELECT max(id) FROM packet");
    if (last.step()) last_id_ = last.number(0);
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
  }
  seek(0);
}

void TakeCursor::seek(std::int64_t time, bool backwards) {
  constexpr std::int64_t all = std::numeric_limits<std::int64_t>::max();
  backwards_ = backwards;
  without_index_ = false;
  at_ = backwards ? Place{all, time} : Place{-1, time};
  kept_.clear();
  kept_bytes_ = 0;
}

/// Where the next packet is.
std::optional<TakeCursor::Place> TakeCursor::place() {
  if (!without_index_) {
    TakeStatement& next = backwards_ ? before_ : after_;
    try {
      next.reset();
      const bool found = next.bind(stream_).bind(at_.time).bind(at_.id).step();
      const Place place = found ? Place{next.number(0), next.number(1)} : Place{};
      next.reset();
      return found ? std::optional(place) : std::nullopt;
    } catch (const Error& error) {
      if (error.kind() != Error::Kind::bad_input) throw;
      without_index_ = true;
      ++damaged_;
    }
  }
  const std::int64_t from = at_.time;
  const std::int64_t step = backwards_ ? -1 : 1;
  std::int64_t id = at_.id < 0 || at_.id > last_id_ ? (backwards_ ? last_id_ : 1) : at_.id + step;
  TakeStatement& next = backwards_ ? by_id_back_ : by_id_;
  int unreadable = 0;  // one after the other
  for (; id >= 1 && id <= last_id_ && unreadable < most_unreadable; id += step) {
    try {
      next.reset();
      const bool found = next.bind(stream_).bind(id).step();
      const Place place = found ? Place{next.number(0), next.number(1)} : Place{};
      next.reset();
      if (!found) return std::nullopt;
      unreadable = 0;
      id = place.id;
      if (backwards_ ? place.time <= from : place.time >= from) return place;
    } catch (const Error& error) {
      if (error.kind() != Error::Kind::bad_input) throw;
      ++damaged_;
      ++unreadable;
    }
  }
  return std::nullopt;
}

/// The packet as it lies in the file; false: it is not there, another stream's, or damaged.
bool TakeCursor::fetch_stored(std::int64_t id, TakePacket& packet, bool& packed) {
  try {
    row_.reset();
    bool whole = false;
    if (row_.bind(id).step() && row_.number(6) == stream_) {
      const auto data = row_.bytes(4);
      packet.time = row_.number(0);
      packet.duration = row_.number(1);
      packet.flags = static_cast<std::uint32_t>(row_.number(2));
      packed = (row_.number(2) & packed_flag) != 0;
      for (const std::string_view caps : formats_.find(row_.number(5))) {
        packet.caps = caps;
        whole = row_.number(3) == packet_hash(packet.time, data, packet, packed);
        if (whole) break;
      }
      if (whole) packet.data.assign(data.begin(), data.end());
      packet.stored = packet.data.size();
    }
    row_.reset();  // who writes waits for it
    return whole;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
    return false;
  }
}

/// Unpacks what is before it first, back to what is at hand or stands alone.
bool TakeCursor::unpack(std::int64_t id, TakePacket& packet) {
  std::vector<std::pair<std::int64_t, std::vector<std::uint8_t>>> chain;
  std::int64_t before = PacketUnpacker::before(packet.data);
  packet.alone = before == 0;
  if (const auto found = kept_.find(id); found != kept_.end()) {
    packet.data = std::move(found->second);
    kept_bytes_ -= packet.data.size();
    kept_.erase(found);
    return true;
  }
  kept_.clear();
  kept_bytes_ = 0;
  std::size_t bytes = 0;
  std::int64_t after = id;
  while (before != 0 && before != unpacker_.last()) {
    TakePacket other;
    bool packed = false;
    // Ids fall, so that no damage makes a ring of it.
    if (before < 0 || before >= after || chain.size() >= longest_key_interval ||
        bytes > largest_chain || !fetch_stored(before, other, packed) || !packed)
      return false;
    bytes += other.data.size();
    after = before;
    before = PacketUnpacker::before(other.data);
    chain.emplace_back(after, std::move(other.data));
  }
  for (; !chain.empty(); chain.pop_back()) {
    auto unpacked = unpacker_.unpack(chain.back().first, chain.back().second);
    if (backwards_) keep(chain.back().first, std::move(unpacked));
  }
  packet.data = unpacker_.unpack(id, packet.data);
  return true;
}

/// For later; the first ones go where they become too many, as they come last.
void TakeCursor::keep(std::int64_t id, std::vector<std::uint8_t> unpacked) {
  kept_bytes_ += unpacked.size();
  kept_.emplace(id, std::move(unpacked));
  while (kept_bytes_ > most_kept) {
    kept_bytes_ -= kept_.begin()->second.size();
    kept_.erase(kept_.begin());
  }
}

std::optional<TakePacket> TakeCursor::fetch(const Place& place) {
  TakePacket packet;
  bool packed = false;
  if (!fetch_stored(place.id, packet, packed) || packet.time != place.time) return std::nullopt;
  try {
    if (packed && !unpack(place.id, packet)) return std::nullopt;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
    return std::nullopt;
  }
  return packet;
}

/// The last one that was announced before packet \p id was written; 0: none.
std::int64_t TakeCursor::event_of(std::int64_t id) {
  if (!event_of_) return 0;
  try {
    event_of_->reset();
    const bool found =
        event_of_->bind(stream_).bind(id).bind(std::string_view(take_announcement)).step();
    const std::int64_t event = found ? event_of_->number(0) : 0;
    event_of_->reset();
    return event;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
    event_of_.reset();
    ++damaged_;
    return 0;
  }
}

std::string TakeCursor::announcement(std::int64_t event) {
  if (!event_ || event == 0) return {};
  try {
    event_->reset();
    std::string value;
    if (event_->bind(event).step() && event_->bytes(0).size() <= largest_announcement)
      value = event_->text(0);
    const bool whole = !value.empty() && event_->number(1) == event_hash(event_->number(2), value);
    event_->reset();
    if (whole) return value;
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;
  }
  ++damaged_;
  return {};
}

std::optional<TakePacket> TakeCursor::peek() {
  const auto found = place();
  if (!found) return std::nullopt;
  TakePacket packet;
  packet.time = found->time;
  try {
    head_.reset();
    if (head_.bind(found->id).step()) {
      packet.duration = head_.number(0);
      packet.flags = static_cast<std::uint32_t>(head_.number(1));
    }
    head_.reset();
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::bad_input) throw;  // next() counts it
  }
  return packet;
}

std::optional<TakePacket> TakeCursor::next() {
  while (const auto found = place()) {
    at_ = *found;
    if (auto packet = fetch(at_)) {
      packet->event = event_of(at_.id);
      return packet;
    }
    ++damaged_;
  }
  return std::nullopt;
}

}  // namespace polyhull
