// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/mesh_memory.h"

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>

#include "plugins/common/element.h"
#include "plugins/common/memory/mapped_memory.h"
#include "wire/mesh_payload.h"

namespace polyhull::element {
namespace {

constexpr char memory_type[] = "polyhull-mesh";
constexpr char pixels_type[] = "polyhull-mesh-pixels";

struct MeshMemory {
  GstMemory memory;  // must be first: GStreamer sees only this
  Mesh mesh;
  std::vector<MappedMemory> pixels;  // what the views borrow from
  std::vector<GstMemory*> of_view;   // of these; null: it has no pixels
  std::once_flag once;
  std::vector<std::uint8_t> header;  // once somebody has asked for it
};

gpointer map(GstMemory* memory, gsize, GstMapFlags) {
  auto* self = reinterpret_cast<MeshMemory*>(memory);
  try {
    std::call_once(self->once, [self] { self->header = write_mesh_header(self->mesh); });
  } catch (const std::exception& error) {
    GST_ERROR("A mesh cannot be written: %s", error.what());
    return nullptr;
  }
  return self->header.data();
}

void unmap(GstMemory*) {}

struct AllPixels {
  GstMemory memory;  // must be first
  Ref<GstMemory> mesh;
  std::once_flag once;
  std::vector<std::uint8_t> bytes;  // once somebody has asked for them

  const MeshMemory& of() const { return *reinterpret_cast<const MeshMemory*>(mesh.get()); }
};

gpointer map_pixels(GstMemory* memory, gsize, GstMapFlags) {
  auto* self = reinterpret_cast<AllPixels*>(memory);
  try {
    std::call_once(self->once, [self] {
      std::vector<std::uint8_t> bytes;
      bytes.reserve(self->memory.maxsize);
      for (const MappedMemory& each : self->of().pixels)
        bytes.insert(bytes.end(), each.bytes().begin(), each.bytes().end());
      self->bytes = std::move(bytes);
    });
  } catch (const std::bad_alloc&) {
    GST_ERROR("There is no memory for the pixels of a mesh's cameras.");
    return nullptr;
  }
  return self->bytes.data();
}

/// A part of the bytes, which keeps the whole.
template <auto map>
GstMemory* share_mapped(GstMemory* memory, gssize offset, gssize size) {
  gpointer data = map(memory, 0, GST_MAP_READ);
  if (data == nullptr) return nullptr;
  const gsize begin = memory->offset + static_cast<gsize>(offset);
  const gsize length =
      size < 0 ? memory->size - static_cast<gsize>(offset) : static_cast<gsize>(size);
  return gst_memory_new_wrapped(
      GST_MEMORY_FLAG_READONLY, data, memory->maxsize, begin, length, gst_memory_ref(memory),
      [](gpointer whole) { gst_memory_unref(static_cast<GstMemory*>(whole)); });
}

/// Of memories that are Held, whose bytes \p map makes.
template <class Held, auto map>
struct LazyAllocator {
  static constexpr const char* type_name =
      std::is_same_v<Held, MeshMemory> ? "PolyhullMeshAllocator" : "PolyhullMeshPixelsAllocator";
  static GType base_type() { return GST_TYPE_ALLOCATOR; }
  static void class_init(gpointer klass) {
    GST_ALLOCATOR_CLASS(klass)->free = [](GstAllocator*, GstMemory* memory) {
      delete reinterpret_cast<Held*>(memory);
    };
  }

  explicit LazyAllocator(gpointer object) {
    auto* allocator = GST_ALLOCATOR_CAST(object);
    allocator->mem_type = std::is_same_v<Held, MeshMemory> ? memory_type : pixels_type;
    allocator->mem_map = map;
    allocator->mem_unmap = unmap;
    allocator->mem_share = share_mapped<map>;
    GST_OBJECT_FLAG_SET(allocator, GST_ALLOCATOR_FLAG_CUSTOM_ALLOC);
  }
};

/// The one of its kind in this process, never freed.
template <class Allocator>
GstAllocator* allocator() {
  static GstAllocator* const one = [] {
    auto* made = static_cast<GstAllocator*>(
        gst_object_ref_sink(g_object_new(type_of<Allocator>(), nullptr)));
    GST_OBJECT_FLAG_SET(made, GST_OBJECT_FLAG_MAY_BE_LEAKED);
    return made;
  }();
  return one;
}

}  // namespace

GstMemory* make_mesh_memory(Mesh mesh, std::span<GstMemory* const> pixels) {
  auto self = std::make_unique<MeshMemory>();
  for (std::size_t i = 0; i < mesh.views.size(); ++i) {
    std::span<const std::uint8_t>& bytes = mesh.views[i].view.pixels;
    bytes = {};
    self->of_view.push_back(pixels[i]);
    if (pixels[i] != nullptr)
      bytes = self->pixels.emplace_back(gst_memory_ref(pixels[i]), GST_MAP_READ).bytes();
  }
  validate_mesh(mesh);
  self->mesh = std::move(mesh);
  const gsize size = mesh_header_size(self->mesh);
  gst_memory_init(&self->memory, GST_MEMORY_FLAG_READONLY,
                  allocator<LazyAllocator<MeshMemory, map>>(), nullptr, size, 0, 0, size);
  return &self.release()->memory;
}

GstMemory* make_all_pixels_memory(GstMemory* mesh) {
  auto self = std::make_unique<AllPixels>();
  self->mesh.reset(gst_memory_ref(mesh));
  gsize size = 0;
  for (const MappedMemory& each : self->of().pixels) size += each.bytes().size();
  gst_memory_init(&self->memory, GST_MEMORY_FLAG_READONLY,
                  allocator<LazyAllocator<AllPixels, map_pixels>>(), nullptr, size, 0, 0, size);
  return &self.release()->memory;
}

GstMemory* mesh_pixels(GstBuffer* buffer, std::size_t number) {
  return reinterpret_cast<const MeshMemory*>(gst_buffer_peek_memory(buffer, 0))->of_view[number];
}

const Mesh* mesh_object(GstBuffer* buffer) {
  if (gst_buffer_n_memory(buffer) == 0) return nullptr;
  GstMemory* first = gst_buffer_peek_memory(buffer, 0);
  if (!gst_memory_is_type(first, memory_type) || first->size != first->maxsize) return nullptr;
  const auto* self = reinterpret_cast<MeshMemory*>(first);
  if (gst_buffer_n_memory(buffer) == 2) {
    GstMemory* second = gst_buffer_peek_memory(buffer, 1);
    if (gst_memory_is_type(second, pixels_type) && second->size == second->maxsize &&
        reinterpret_cast<const AllPixels*>(second)->mesh.get() == first)
      return &self->mesh;
  }
  // Somebody may have put the memories together anew.
  if (gst_buffer_n_memory(buffer) != 1 + self->pixels.size()) return nullptr;
  for (std::size_t i = 0; i < self->pixels.size(); ++i)
    if (gst_buffer_peek_memory(buffer, static_cast<guint>(i + 1)) != self->pixels[i].memory())
      return nullptr;
  return &self->mesh;
}

}  // namespace polyhull::element
