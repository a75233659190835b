// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/recycling_allocator.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <vector>

namespace polyhull::element {
namespace {

constexpr gsize alignment = 64;
constexpr gsize granularity = 64 * 1024;
constexpr std::size_t most_kept = 16;

struct Block {
  GstMemory memory;  // must be first: GStreamer sees only this
  guint8* data;
  gsize capacity;  // 0: shares its parent's data, read-only
  std::atomic<std::uint64_t> stamp;
};

struct Private {
  std::mutex mutex;          // protects kept
  std::vector<Block*> kept;  // free blocks, in the order they came back
};

struct PolyhullRecyclingAllocator {
  GstAllocator parent;
  Private* priv;
};

struct PolyhullRecyclingAllocatorClass {
  GstAllocatorClass parent_class;
};

GType polyhull_recycling_allocator_get_type();
G_DEFINE_TYPE(PolyhullRecyclingAllocator, polyhull_recycling_allocator, GST_TYPE_ALLOCATOR)

Private& private_of(GstAllocator* allocator) {
  return *reinterpret_cast<PolyhullRecyclingAllocator*>(allocator)->priv;
}

void destroy(Block* block) {
  std::free(block->data);
  delete block;
}

/// The smallest kept block that holds \p needed bytes and does not waste most of itself.
Block* take(Private& priv, gsize needed) {
  const std::scoped_lock lock(priv.mutex);
  auto best = priv.kept.end();
  for (auto it = priv.kept.begin(); it != priv.kept.end(); ++it) {
    if ((*it)->capacity < needed || (*it)->capacity / 8 > std::max(needed, granularity)) continue;
    if (best == priv.kept.end() || (*it)->capacity < (*best)->capacity) best = it;
  }
  if (best == priv.kept.end()) return nullptr;
  Block* const block = *best;
  priv.kept.erase(best);
  return block;
}

GstMemory* allocate(GstAllocator* allocator, gsize size, GstAllocationParams* params) {
  const gsize needed = size + params->prefix + params->padding;
  Block* block = take(private_of(allocator), needed);
  if (block == nullptr) {
    // A quarter more than asked for: a figure that grows a little keeps its block.
    const gsize capacity = (needed + needed / 4 + granularity) / granularity * granularity;
    auto* data = static_cast<guint8*>(std::aligned_alloc(alignment, capacity));
    if (data == nullptr) return nullptr;
    block = new Block{};
    block->data = data;
    block->capacity = capacity;
  }
  gst_memory_init(&block->memory, params->flags, allocator, nullptr, block->capacity, alignment - 1,
                  params->prefix, size);
  return &block->memory;
}

void release(GstAllocator* allocator, GstMemory* memory) {
  auto* block = reinterpret_cast<Block*>(memory);
  if (block->capacity == 0) {
    delete block;
    return;
  }
  Private& priv = private_of(allocator);
  Block* dropped = nullptr;
  {
    const std::scoped_lock lock(priv.mutex);
    priv.kept.push_back(block);
    if (priv.kept.size() > most_kept) {
      dropped = priv.kept.front();
      priv.kept.erase(priv.kept.begin());
    }
  }
  if (dropped != nullptr) destroy(dropped);
}

gpointer map(GstMemory* memory, gsize, GstMapFlags flags) {
  static std::atomic<std::uint64_t> last{0};
  auto* block = reinterpret_cast<Block*>(memory);
  // Whoever reads the stamp got the memory after it was unmapped, by a pad or a queue.
  if ((flags & GST_MAP_WRITE) != 0)
    block->stamp.store(last.fetch_add(1, std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  return block->data;
}

void unmap(GstMemory*) {}

GstMemory* share(GstMemory* memory, gssize offset, gssize size) {
  auto* block = reinterpret_cast<Block*>(memory);
  GstMemory* parent = memory->parent != nullptr ? memory->parent : memory;
  if (size == -1) size = static_cast<gssize>(memory->size) - offset;
  auto* part = new Block{};
  part->data = block->data;
  gst_memory_init(&part->memory,
                  static_cast<GstMemoryFlags>(GST_MINI_OBJECT_FLAGS(parent) |
                                              GST_MINI_OBJECT_FLAG_LOCK_READONLY),
                  memory->allocator, parent, memory->maxsize, memory->align,
                  memory->offset + static_cast<gsize>(offset), static_cast<gsize>(size));
  return &part->memory;
}

void polyhull_recycling_allocator_init(PolyhullRecyclingAllocator* self) {
  self->priv = new Private;
  GstAllocator* allocator = GST_ALLOCATOR_CAST(self);
  allocator->mem_type = "polyhull-recycled";
  allocator->mem_map = map;
  allocator->mem_unmap = unmap;
  allocator->mem_share = share;
  // Only make_recycling_allocator() hands these out, gst_allocator_alloc() works on them as usual.
  GST_OBJECT_FLAG_UNSET(allocator, GST_ALLOCATOR_FLAG_CUSTOM_ALLOC);
}

void finalize(GObject* object) {
  auto* self = reinterpret_cast<PolyhullRecyclingAllocator*>(object);
  for (Block* block : self->priv->kept) destroy(block);
  delete self->priv;
  G_OBJECT_CLASS(polyhull_recycling_allocator_parent_class)->finalize(object);
}

void polyhull_recycling_allocator_class_init(PolyhullRecyclingAllocatorClass* klass) {
  G_OBJECT_CLASS(klass)->finalize = finalize;
  auto* allocator_class = reinterpret_cast<GstAllocatorClass*>(klass);
  allocator_class->alloc = allocate;
  allocator_class->free = release;
}

}  // namespace

GstAllocator* make_recycling_allocator() {
  auto* allocator =
      static_cast<GstAllocator*>(g_object_new(polyhull_recycling_allocator_get_type(), nullptr));
  return static_cast<GstAllocator*>(gst_object_ref_sink(allocator));
}

std::uint64_t write_stamp(GstBuffer* buffer) {
  if (gst_buffer_n_memory(buffer) != 1) return 0;
  GstMemory* memory = gst_buffer_peek_memory(buffer, 0);
  if (G_OBJECT_TYPE(memory->allocator) != polyhull_recycling_allocator_get_type()) return 0;
  return reinterpret_cast<Block*>(memory)->stamp.load(std::memory_order_relaxed);
}

}  // namespace polyhull::element
