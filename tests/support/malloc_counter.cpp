// SPDX-License-Identifier: LGPL-2.1-or-later
#include "support/malloc_counter.h"

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <new>

// GCC and Clang tell of the address sanitizer in different ways.
#if defined(__SANITIZE_ADDRESS__)
#define POLYHULL_OWN_MALLOC 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define POLYHULL_OWN_MALLOC 0
#endif
#endif
#if !defined(POLYHULL_OWN_MALLOC)
#if defined(__GLIBC__)
#define POLYHULL_OWN_MALLOC 1
#else
#define POLYHULL_OWN_MALLOC 0
#endif
#endif

namespace {

std::atomic<bool> counting{false};
std::atomic<long> taken{0};
std::atomic<std::size_t> largest{0};

void note(std::size_t size) {
  if (!counting.load(std::memory_order_relaxed)) return;
  taken.fetch_add(1, std::memory_order_relaxed);
  std::size_t before = largest.load(std::memory_order_relaxed);
  while (size > before && !largest.compare_exchange_weak(before, size)) {
  }
}

}  // namespace

#if POLYHULL_OWN_MALLOC
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) {
  note(size);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note(count * size);
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  note(size);
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note(size);
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  note(size);
  *memory = __libc_memalign(alignment, size);
  return *memory != nullptr ? 0 : ENOMEM;
}
}
#else
void* operator new(std::size_t size) {
  note(size);
  void* memory = std::malloc(size != 0 ? size : 1);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif

namespace polyhull::test {

MallocCount count_mallocs(const std::function<void()>& work) {
  taken = 0;
  largest = 0;
  counting = true;
  work();
  counting = false;
  return {taken, largest};
}

bool counts_malloc() {
  return POLYHULL_OWN_MALLOC != 0;
}

}  // namespace polyhull::test
