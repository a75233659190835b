// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// What packing and unpacking keep of the packet before. Internal.
#pragma once

#include <vector>

#include "take/packed_layout.h"
#include "take/picture_filter.h"

namespace polyhull {

struct PacketBefore {
  std::vector<std::uint8_t> packet, head;
  std::vector<Region> regions;

  /// Its picture at the same place in the order of pictures.
  PictureBefore picture(std::size_t index) const {
    for (const Region& region : regions)
      if (region.pictured() && index-- == 0) return {region, packet.data() + region.offset};
    return {};
  }
  /// What tells zstd of the next head; above a few MiB it would cost more than it gives.
  Bytes prefix() const { return head.size() <= (4u << 20) ? Bytes(head) : Bytes(); }
};

}  // namespace polyhull
