// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How many half-edges run between two vertices, in either direction: a hash table.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "base/edge_key.h"

namespace polyhull::hull {

class EdgeCounts {
 public:
  /// Forgets all; room for \p edges different ones to begin with.
  void clear(std::size_t edges) {
    slots_.assign(std::bit_ceil(2 * edges + 16), {});
    used_ = 0;
  }
  void add(std::uint32_t a, std::uint32_t b) {
    if (2 * used_ >= slots_.size()) grow();
    Slot& slot = slots_[place(edge_key(a, b))];
    if (slot.key == free_slot) slot.key = edge_key(a, b), ++used_;
    ++slot.count;
  }
  /// Of an edge that was added.
  void remove(std::uint32_t a, std::uint32_t b) { --slots_[place(edge_key(a, b))].count; }
  bool contains(std::uint32_t a, std::uint32_t b) const {
    return slots_[place(edge_key(a, b))].count > 0;
  }

 private:
  static constexpr std::uint64_t free_slot = ~std::uint64_t{0};
  struct Slot {
    std::uint64_t key = free_slot;  ///< stays when the count has gone back to 0
    std::uint32_t count = 0;
  };
  /// Where the key is or would go.
  std::size_t place(std::uint64_t key) const {
    std::uint64_t h = key * 0x9e3779b97f4a7c15u;
    h ^= h >> 32;
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = h & mask;
    while (slots_[at].key != key && slots_[at].key != free_slot) at = (at + 1) & mask;
    return at;
  }
  void grow() {
    old_.swap(slots_);
    clear(old_.size());
    for (const Slot& slot : old_)
      if (slot.count > 0) slots_[place(slot.key)] = slot, ++used_;
  }

  std::vector<Slot> slots_, old_;  // a power of two, half full at most
  std::size_t used_ = 0;
};

}  // namespace polyhull::hull
