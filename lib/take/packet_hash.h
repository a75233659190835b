// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What tells a packet that has changed on the disk, and one that is packed.
#pragma once

#include <cstdint>
#include <span>

#include "base/content_hash.h"

namespace polyhull {

/// In the flags, above a buffer's own.
inline constexpr std::int64_t packed_flag = std::int64_t{1} << 32;

inline std::int64_t packet_hash(std::int64_t time, std::span<const std::uint8_t> data) {
  ContentHash hash;
  hash.add(time);
  hash.add_bytes(data.data(), data.size());
  return static_cast<std::int64_t>(hash.value());
}

}  // namespace polyhull
