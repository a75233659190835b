// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views of an element that makes one per frame: buffers of application/x-polyhull-view whose
/// memory is used again.
#pragma once

#include <gst/gst.h>

#include "mesh/view.h"

namespace polyhull::element {

/// Memory mapped for writing; unmapped when it goes out of scope.
class WritableMemory {
 public:
  /// Takes the reference. Throws std::bad_alloc where \p memory is null or cannot be mapped.
  explicit WritableMemory(GstMemory* memory);
  ~WritableMemory();
  WritableMemory(const WritableMemory&) = delete;
  WritableMemory& operator=(const WritableMemory&) = delete;

  std::uint8_t* data() { return map_.data; }
  std::span<const std::uint8_t> bytes() const { return {map_.data, map_.size}; }
  GstMemory* memory() const { return memory_; }

 private:
  GstMemory* memory_;
  GstMapInfo map_;
};

/// Memory mapped for reading; unmapped when it goes out of scope. Keeps no reference.
class ReadableMemory {
 public:
  /// Throws std::bad_alloc where \p memory cannot be mapped.
  explicit ReadableMemory(GstMemory* memory);
  ~ReadableMemory();
  ReadableMemory(const ReadableMemory&) = delete;
  ReadableMemory& operator=(const ReadableMemory&) = delete;

  std::span<const std::uint8_t> bytes() const { return {map_.data, map_.size}; }

 private:
  GstMemory* memory_;
  GstMapInfo map_;
};

class ViewWriter {
 public:
  ViewWriter();
  ~ViewWriter();
  ViewWriter(const ViewWriter&) = delete;
  ViewWriter& operator=(const ViewWriter&) = delete;

  /// Memory for \p size bytes of pixels (at least 1).
  GstMemory* allocate(std::size_t size) const;

  /// A new buffer: the header of \p view in a memory of its own, then \p pixels (a reference is
  /// added; null where the view has none), whose bytes View::pixels shows. Times, flags and
  /// duration are those of \p source. Throws Error for a view that breaks a rule of
  /// validate_view().
  GstBuffer* write(const View& view, GstMemory* pixels, GstBuffer* source) const;

 private:
  GstAllocator* allocator_;
};

/// The caps of the views made from video of \p video: they keep its frame rate, if it has one.
GstCaps* view_caps_of(const GstCaps* video);

}  // namespace polyhull::element
