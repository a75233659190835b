// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/payload_buffer.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "plugins/common/memory/mesh_memory.h"
#include "wire/mesh_payload.h"
#include "wire/view_payload.h"

namespace polyhull::element {
namespace {

// Reads memory by memory; only bytes that were cut elsewhere than between blocks are joined.
template <class Read>
auto read_segments(MappedBuffer& mapped, Read read) {
  try {
    return read(mapped.segments());
  } catch (const Error& error) {
    if (error.kind() != Error::Kind::unsupported || mapped.segments().size() < 2) throw;
  }
  mapped.join();
  return read(mapped.segments());
}

/// The pixels of \p view as one memory, shared from \p source where that is possible; null: none.
GstMemory* pixel_memory(GstBuffer* buffer, const View& view, const PixelSource& source) {
  const gsize size = view.pixels.size();
  if (size == 0) return nullptr;
  if (source.memory != nullptr && source.memory->size == size) {
    gst_buffer_add_parent_buffer_meta(buffer, source.buffer);
    return gst_memory_ref(source.memory);
  }
  guint index = 0, count = 0;
  gsize skip = 0;
  if (source.buffer != nullptr &&
      gst_buffer_find_memory(source.buffer, source.offset, size, &index, &count, &skip) &&
      count == 1) {
    GstMemory* whole = gst_buffer_peek_memory(source.buffer, index);
    GstMemory* part =
        skip == 0 && whole->size == size
            ? gst_memory_ref(whole)
            : gst_memory_share(whole, static_cast<gssize>(skip), static_cast<gssize>(size));
    // A pool must not hand the frame's memory out again while it is seen here.
    if (part != nullptr) gst_buffer_add_parent_buffer_meta(buffer, source.buffer);
    if (part != nullptr) return part;
  }
  MappedMemory memory(gst_allocator_alloc(nullptr, size, nullptr), GST_MAP_WRITE);
  std::copy(view.pixels.begin(), view.pixels.end(), memory.data());
  return gst_memory_ref(memory.memory());
}

}  // namespace

MappedBuffer::MappedBuffer(GstBuffer* buffer) : buffer_(gst_buffer_ref(buffer)) {
  for (guint i = 0; i < gst_buffer_n_memory(buffer); ++i)
    maps_.emplace_back(gst_buffer_get_memory(buffer, i), GST_MAP_READ);
  for (const MappedMemory& map : maps_) segments_.push_back(map.bytes());
}

void MappedBuffer::join() {
  MappedMemory whole(gst_buffer_get_all_memory(buffer()), GST_MAP_READ);
  maps_.clear();
  maps_.push_back(std::move(whole));
  segments_ = {maps_.front().bytes()};
}

ViewBuffer::ViewBuffer(GstBuffer* buffer)
    : mapped_(buffer),
      view_(read_segments(mapped_, [](std::span<const Bytes> s) { return read_view(s); })) {}

PixelSource ViewBuffer::pixels() const {
  return {buffer(), gst_buffer_get_size(buffer()) - view_.pixels.size()};
}

GstMemory* ViewWriter::allocate(std::size_t size) const {
  return gst_allocator_alloc(allocator_.get(), size, nullptr);
}

GstBuffer* ViewWriter::write_header(const View& view, GstBuffer* source) const {
  const std::vector<std::uint8_t> header = write_view_header(view);
  MappedMemory memory(allocate(header.size()), GST_MAP_WRITE);
  std::copy(header.begin(), header.end(), memory.data());
  GstBuffer* buffer = gst_buffer_new();
  gst_buffer_append_memory(buffer, gst_memory_ref(memory.memory()));
  gst_buffer_copy_into(
      buffer, source,
      static_cast<GstBufferCopyFlags>(GST_BUFFER_COPY_FLAGS | GST_BUFFER_COPY_TIMESTAMPS), 0, -1);
  return buffer;
}

GstBuffer* ViewWriter::write(const View& view, GstMemory* pixels, GstBuffer* source) const {
  GstBuffer* buffer = write_header(view, source);
  if (pixels != nullptr) gst_buffer_append_memory(buffer, gst_memory_ref(pixels));
  return buffer;
}

GstBuffer* ViewWriter::write(const View& view, const PixelSource& pixels, GstBuffer* source) const {
  g_autoptr(GstBuffer) buffer = write_header(view, source);
  if (GstMemory* memory = pixel_memory(buffer, view, pixels))
    gst_buffer_append_memory(buffer, memory);
  return g_steal_pointer(&buffer);
}

MeshBuffer::MeshBuffer(GstBuffer* buffer)
    : buffer_(gst_buffer_ref(buffer)), mesh_(mesh_object(buffer)) {
  if (mesh_ != nullptr) return;
  mapped_.emplace(buffer);
  decoded_ = read_segments(*mapped_, [](std::span<const Bytes> s) { return read_mesh(s); });
  mesh_ = &decoded_;
}

PixelSource MeshBuffer::pixels(std::size_t view) const {
  if (!mapped_) return {buffer(), 0, mesh_pixels(buffer(), view)};
  gsize offset = gst_buffer_get_size(buffer());
  for (std::size_t i = mesh_->views.size(); i-- > view;)
    offset -= mesh_->views[i].view.pixels.size();
  return {buffer(), offset};
}

GstBuffer* make_mesh_buffer(Mesh mesh, std::span<const PixelSource> pixels) {
  g_autoptr(GstBuffer) buffer = gst_buffer_new();
  std::vector<Ref<GstMemory>> kept;
  std::vector<GstMemory*> memories;  // null: a view without pixels
  for (std::size_t i = 0; i < mesh.views.size(); ++i) {
    GstMemory* memory =
        pixel_memory(buffer, mesh.views[i].view, i < pixels.size() ? pixels[i] : PixelSource{});
    memories.push_back(memory);
    if (memory != nullptr) kept.emplace_back(memory);
  }
  GstMemory* header = make_mesh_memory(std::move(mesh), memories);
  gst_buffer_append_memory(buffer, header);
  // A buffer that gets more memories than it holds copies them all into one.
  if (kept.size() >= gst_buffer_get_max_memory()) {
    gst_buffer_append_memory(buffer, make_all_pixels_memory(header));
  } else {
    for (Ref<GstMemory>& memory : kept) gst_buffer_append_memory(buffer, memory.release());
  }
  return g_steal_pointer(&buffer);
}

}  // namespace polyhull::element
