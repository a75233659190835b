// SPDX-License-Identifier: LGPL-2.1-or-later
#include "plugins/common/memory/recycling_allocator.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <mutex>
#include <vector>

#include "plugins/common/element.h"

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

struct RecyclingAllocator {
  static constexpr char type_name[] = "PolyhullRecyclingAllocator";
  static GType base_type() { return GST_TYPE_ALLOCATOR; }
  static void class_init(gpointer klass);
  explicit RecyclingAllocator(gpointer object);
  ~RecyclingAllocator();

  std::mutex mutex;          // protects kept
  std::vector<Block*> kept;  // free blocks, in the order they came back
};

void destroy(Block* block) {
  std::free(block->data);
  delete block;
}

/// The smallest kept block that holds \p needed bytes and does not waste most of itself.
Block* take(RecyclingAllocator& self, gsize needed) {
  const std::scoped_lock lock(self.mutex);
  auto best = self.kept.end();
  for (auto it = self.kept.begin(); it != self.kept.end(); ++it) {
    if ((*it)->capacity < needed || (*it)->capacity / 8 > std::max(needed, granularity)) continue;
    if (best == self.kept.end() || (*it)->capacity < (*best)->capacity) best = it;
  }
  if (best == self.kept.end()) return nullptr;
  Block* const block = *best;
  self.kept.erase(best);
  return block;
}

GstMemory* allocate(GstAllocator* allocator, gsize size, GstAllocationParams* params) {
  const gsize needed = size + params->prefix + params->padding;
  Block* block = take(state_of<RecyclingAllocator>(allocator), needed);
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
  auto& self = state_of<RecyclingAllocator>(allocator);
  Block* dropped = nullptr;
  {
    const std::scoped_lock lock(self.mutex);
    self.kept.push_back(block);
    if (self.kept.size() > most_kept) {
      dropped = self.kept.front();
      self.kept.erase(self.kept.begin());
    }
  }
  if (dropped != nullptr) destroy(dropped);
}

gpointer map_block(GstMemory* memory, gsize, GstMapFlags flags) {
  static std::atomic<std::uint64_t> last{0};
  auto* block = reinterpret_cast<Block*>(memory);
  // Whoever reads the stamp got the memory after it was unmapped, by a pad or a queue.
  if ((flags & GST_MAP_WRITE) != 0)
    block->stamp.store(last.fetch_add(1, std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  return block->data;
}

void unmap_block(GstMemory*) {}

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

RecyclingAllocator::RecyclingAllocator(gpointer object) {
  auto* allocator = GST_ALLOCATOR_CAST(object);
  allocator->mem_type = "polyhull-recycled";
  allocator->mem_map = map_block;
  allocator->mem_unmap = unmap_block;
  allocator->mem_share = share;
  // Only make_recycling_allocator() hands these out, gst_allocator_alloc() works on them as usual.
  GST_OBJECT_FLAG_UNSET(allocator, GST_ALLOCATOR_FLAG_CUSTOM_ALLOC);
}

RecyclingAllocator::~RecyclingAllocator() {
  for (Block* block : kept) destroy(block);
}

void RecyclingAllocator::class_init(gpointer klass) {
  GST_ALLOCATOR_CLASS(klass)->alloc = allocate;
  GST_ALLOCATOR_CLASS(klass)->free = release;
}

}  // namespace

GstAllocator* make_recycling_allocator() {
  return static_cast<GstAllocator*>(
      gst_object_ref_sink(g_object_new(type_of<RecyclingAllocator>(), nullptr)));
}

std::uint64_t write_stamp(GstBuffer* buffer) {
  if (gst_buffer_n_memory(buffer) != 1) return 0;
  GstMemory* memory = gst_buffer_peek_memory(buffer, 0);
  if (G_OBJECT_TYPE(memory->allocator) != type_of<RecyclingAllocator>()) return 0;
  return reinterpret_cast<Block*>(memory)->stamp.load(std::memory_order_relaxed);
}

}  // namespace polyhull::element
