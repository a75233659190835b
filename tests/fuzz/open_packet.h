// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A take's packed packets with their parts not by zstd, so that a fuzzer gets at what lies behind it.
#pragma once

#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "take/packed_layout.h"

namespace polyhull::test {

/// \p packed, which stands alone, with head and pictures as they are before zstd.
inline std::vector<std::uint8_t> open_packet(Bytes packed) {
  const PackedPrefix prefix = read_packed_prefix(packed);
  std::vector<std::uint8_t> out(sizeof prefix + prefix.head + prefix.pictures);
  std::memcpy(out.data(), &prefix, sizeof prefix);
  const std::uint8_t* from = packed.data() + sizeof prefix;
  ZSTD_decompress(out.data() + sizeof prefix, prefix.head, from, prefix.head_packed);
  from += prefix.head_packed;
  ZSTD_decompress(out.data() + sizeof prefix + prefix.head, prefix.pictures, from,
                  prefix.pictures_packed);
  out.insert(out.end(), from + prefix.pictures_packed, packed.data() + packed.size());
  return out;
}

/// The way back, of any bytes: a packed packet whose parts zstd unpacks to what is there.
inline std::vector<std::uint8_t> close_packet(Bytes open) {
  PackedPrefix prefix;
  if (open.size() < sizeof prefix) return {};
  std::memcpy(&prefix, open.data(), sizeof prefix);
  open = open.subspan(sizeof prefix);
  std::vector<std::uint8_t> out(sizeof prefix);
  const auto add = [&](std::uint32_t& size, std::uint32_t& packed) {
    size = static_cast<std::uint32_t>(std::min<std::size_t>(size, open.size()));
    const std::size_t from = out.size();
    out.resize(from + ZSTD_compressBound(size));
    packed = static_cast<std::uint32_t>(
        ZSTD_compress(out.data() + from, out.size() - from, open.data(), size, 1));
    out.resize(from + packed);
    open = open.subspan(size);
  };
  add(prefix.head, prefix.head_packed);
  if (prefix.pictures == 0)
    prefix.pictures_packed = 0;
  else
    add(prefix.pictures, prefix.pictures_packed);
  std::memcpy(out.data(), &prefix, sizeof prefix);
  out.insert(out.end(), open.begin(), open.end());
  return out;
}

}  // namespace polyhull::test
