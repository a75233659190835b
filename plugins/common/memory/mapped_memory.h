// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// References on memories and buffers, and mapped memory, that end with their scope.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "base/error.h"

namespace polyhull::element {

/// Gives a reference back.
struct Unref {
  void operator()(GstMemory* memory) const { gst_memory_unref(memory); }
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
  void operator()(gpointer object) const { gst_object_unref(object); }
};
using MemoryRef = std::unique_ptr<GstMemory, Unref>;
using BufferRef = std::unique_ptr<GstBuffer, Unref>;

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
  MemoryRef memory_;
  GstMapInfo map_{};
};

}  // namespace polyhull::element
