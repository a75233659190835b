// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// Views and meshes in GstBuffers. The first memory of a buffer holds the payload's header, each
/// pixel block is a memory of its own that is shared with where it came from: from contourfind to
/// composite no pixel is copied. A mesh's header is an object until somebody reads its bytes
/// (mesh_memory.h). Buffers from a wire hold everything in one memory and are read the same way.
#pragma once

#include <gst/gst.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/mesh.h"
#include "plugins/common/memory/mapped_memory.h"
#include "plugins/common/memory/recycling_allocator.h"
#include "wire/payload.h"

namespace polyhull::element {

inline constexpr char view_caps[] = "application/x-polyhull-view";
inline constexpr char mesh_caps[] = "application/x-polyhull-mesh";

/// Bytes [offset, …) of \p buffer hold a view's pixels; null: copy View::pixels. Where a memory holds
/// nothing else and lives as long as the buffer, it is told instead of the offset.
struct PixelSource {
  GstBuffer* buffer = nullptr;
  gsize offset = 0;
  GstMemory* memory = nullptr;
};

/// A buffer mapped for reading, memory by memory. Keeps a reference on it.
class MappedBuffer {
 public:
  /// Throws Error if a memory cannot be mapped.
  explicit MappedBuffer(GstBuffer* buffer);

  GstBuffer* buffer() const { return buffer_.get(); }
  std::span<const Bytes> segments() const { return segments_; }

  /// Maps the buffer again as one segment, which copies where it has several memories.
  void join();

 private:
  Ref<GstBuffer> buffer_;
  std::vector<MappedMemory> maps_;
  std::vector<Bytes> segments_;
};

/// A view read from a buffer; View::pixels stays valid as long as this object.
class ViewBuffer {
 public:
  /// Throws Error for bytes that are not a view.
  explicit ViewBuffer(GstBuffer* buffer);
  const View& view() const { return view_; }
  GstBuffer* buffer() const { return mapped_.buffer(); }
  PixelSource pixels() const;

 private:
  MappedBuffer mapped_;
  View view_;
};

/// Makes the buffers of views, one per frame; their memory is used again.
class ViewWriter {
 public:
  /// Memory for \p size bytes of pixels (at least 1).
  GstMemory* allocate(std::size_t size) const;

  /// A new buffer: the header of \p view in a memory of its own, then \p pixels (a reference is
  /// added; null where the view has none), whose bytes View::pixels shows. Times, flags and
  /// duration are those of \p source. Throws Error for a view that breaks a rule of
  /// validate_view().
  GstBuffer* write(const View& view, GstMemory* pixels, GstBuffer* source) const;

  /// The same with the pixels of another buffer, shared where that is possible.
  GstBuffer* write(const View& view, const PixelSource& pixels, GstBuffer* source) const;

 private:
  GstBuffer* write_header(const View& view, GstBuffer* source) const;

  Ref<GstAllocator> allocator_{make_recycling_allocator()};
};

/// The mesh in a buffer: the object that it holds, or read from its bytes. The mesh and its views'
/// pixels stay valid as long as this object.
class MeshBuffer {
 public:
  /// Throws Error for bytes that are not a mesh.
  explicit MeshBuffer(GstBuffer* buffer);
  MeshBuffer(const MeshBuffer&) = delete;
  MeshBuffer& operator=(const MeshBuffer&) = delete;
  const Mesh& mesh() const { return *mesh_; }
  GstBuffer* buffer() const { return buffer_.get(); }
  PixelSource pixels(std::size_t view) const;

 private:
  Ref<GstBuffer> buffer_;
  std::optional<MappedBuffer> mapped_;
  Mesh decoded_;
  const Mesh* mesh_;
};

/// A new buffer (without times and flags) that holds \p mesh. \p pixels: one source per view, or
/// none to copy. Throws Error for a mesh that breaks a rule of validate_mesh().
GstBuffer* make_mesh_buffer(Mesh mesh, std::span<const PixelSource> pixels = {});

}  // namespace polyhull::element
