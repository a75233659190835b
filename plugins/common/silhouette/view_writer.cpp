// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/view_writer.h"

#include <algorithm>
#include <new>

#include "plugins/common/memory/payload_buffer.h"
#include "plugins/common/memory/recycling_allocator.h"
#include "wire/view_payload.h"

namespace polyhull::element {

WritableMemory::WritableMemory(GstMemory* memory) : memory_(memory) {
  if (memory_ == nullptr) throw std::bad_alloc();
  if (!gst_memory_map(memory_, &map_, GST_MAP_READWRITE)) {
    gst_memory_unref(memory_);
    throw std::bad_alloc();
  }
}

WritableMemory::~WritableMemory() {
  gst_memory_unmap(memory_, &map_);
  gst_memory_unref(memory_);
}

ReadableMemory::ReadableMemory(GstMemory* memory) : memory_(memory) {
  if (!gst_memory_map(memory_, &map_, GST_MAP_READ)) throw std::bad_alloc();
}

ReadableMemory::~ReadableMemory() {
  gst_memory_unmap(memory_, &map_);
}

ViewWriter::ViewWriter() : allocator_(make_recycling_allocator()) {}

ViewWriter::~ViewWriter() {
  gst_object_unref(allocator_);
}

GstMemory* ViewWriter::allocate(std::size_t size) const {
  return gst_allocator_alloc(allocator_, size, nullptr);
}

GstBuffer* ViewWriter::write(const View& view, GstMemory* pixels, GstBuffer* source) const {
  const std::vector<std::uint8_t> header = write_view_header(view);
  WritableMemory memory(allocate(header.size()));
  std::copy(header.begin(), header.end(), memory.data());
  GstBuffer* buffer = gst_buffer_new();
  gst_buffer_append_memory(buffer, gst_memory_ref(memory.memory()));
  if (pixels != nullptr) gst_buffer_append_memory(buffer, gst_memory_ref(pixels));
  gst_buffer_copy_into(
      buffer, source,
      static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  return buffer;
}

GstCaps* view_caps_of(const GstCaps* video) {
  GstCaps* caps = gst_caps_new_empty_simple(view_caps);
  const GstStructure* structure =
      gst_caps_get_size(video) > 0 ? gst_caps_get_structure(video, 0) : nullptr;
  const GValue* rate =
      structure != nullptr ? gst_structure_get_value(structure, "framerate") : nullptr;
  if (rate != nullptr) gst_caps_set_value(caps, "framerate", rate);
  return caps;
}

}  // namespace polyhull::element
