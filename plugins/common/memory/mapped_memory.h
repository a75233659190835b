// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Memory that is mapped for a scope.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "base/error.h"
#include "plugins/common/references.h"

namespace polyhull::element {

/// A memory that stays mapped as long as this lives.
class MappedMemory {
 public:
  /// Takes the reference. Throws std::bad_alloc where \p memory is null, Error where it cannot be
  /// mapped.
  MappedMemory(GstMemory* memory, GstMapFlags flags) : memory_(memory) {
    if (memory == nullptr) throw std::bad_alloc();
    if (!gst_memory_map(memory, &map_, flags))
      throw Error(
          Error::Kind::io,
          "A memory of {} bytes of a buffer cannot be mapped; look at the element in front.",
          gst_memory_get_sizes(memory, nullptr, nullptr));
  }
  ~MappedMemory() {
    if (memory_ != nullptr) gst_memory_unmap(memory_.get(), &map_);
  }
  MappedMemory(MappedMemory&&) noexcept = default;
  MappedMemory& operator=(MappedMemory&&) = delete;

  std::uint8_t* data() { return map_.data; }
  std::span<const std::uint8_t> bytes() const { return {map_.data, map_.size}; }
  GstMemory* memory() const { return memory_.get(); }

 private:
  Ref<GstMemory> memory_;
  GstMapInfo map_{};
};

}  // namespace polyhull::element
