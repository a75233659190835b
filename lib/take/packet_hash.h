// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tells a packet that has changed on the disk, and one that is packed.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "base/content_hash.h"
#include "take/take.h"

namespace polyhull {

/// In the flags, above a buffer's own.
inline constexpr std::int64_t packed_flag = std::int64_t{1} << 32;

/// Of a packet that is stored at \p time as \p data; of one that is packed all that \p packet says.
inline std::int64_t packet_hash(std::int64_t time, std::span<const std::uint8_t> data,
                                const TakePacket& packet, bool packed) {
  ContentHash hash;
  hash.add(time);
  hash.add_bytes(data.data(), data.size());
  if (packed) {
    hash.add(packet.duration);
    hash.add(std::int64_t{packet.flags});
    hash.add_bytes(reinterpret_cast<const std::uint8_t*>(packet.caps.data()), packet.caps.size());
  }
  return static_cast<std::int64_t>(hash.value());
}

/// Of an event that is stored with packet \p packet.
inline std::int64_t event_hash(std::int64_t packet, std::string_view value) {
  ContentHash hash;
  hash.add(packet);
  hash.add_bytes(reinterpret_cast<const std::uint8_t*>(value.data()), value.size());
  return static_cast<std::int64_t>(hash.value());
}

}  // namespace polyhull
