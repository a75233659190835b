// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/silhouette/view_writer.h"

#include <algorithm>

#include "plugins/common/memory/payload_buffer.h"
#include "wire/view_payload.h"

namespace polyhull::element {

GstMemory* ViewWriter::allocate(std::size_t size) const {
  return gst_allocator_alloc(allocator_.get(), size, nullptr);
}

GstBuffer* ViewWriter::write(const View& view, GstMemory* pixels, GstBuffer* source) const {
  const std::vector<std::uint8_t> header = write_view_header(view);
  MappedMemory memory(allocate(header.size()), GST_MAP_WRITE);
  std::copy(header.begin(), header.end(), memory.data());
  g_autoptr(GstBuffer) buffer = gst_buffer_new();
  gst_buffer_append_memory(buffer, gst_memory_ref(memory.memory()));
  if (pixels != nullptr) gst_buffer_append_memory(buffer, gst_memory_ref(pixels));
  gst_buffer_copy_into(
      buffer, source,
      static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  return g_steal_pointer(&buffer);
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
