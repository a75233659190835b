// SPDX-License-Identifier: LGPL-2.1-or-later
// What HullBuilder allocates from frame to frame of a moving figure: in the steady state nothing
// that grows. Counted by this program's own operator new, which the library uses, too.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

#include "base/thread_pool.h"
#include "hull/hull.h"
#include "support/scenes.h"

namespace {

std::atomic<std::size_t> allocations{0};
std::atomic<std::ptrdiff_t> live_bytes{0};

void* allocate(std::size_t size, std::size_t alignment) {
  void* memory = nullptr;
  if (alignment <= alignof(std::max_align_t)) {
    memory = std::malloc(size == 0 ? 1 : size);
  } else if (posix_memalign(&memory, alignment, size) != 0) {
    memory = nullptr;
  }
  if (memory == nullptr) throw std::bad_alloc();
  ++allocations;
  live_bytes += static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  return memory;
}

void release(void* memory) {
  if (memory == nullptr) return;
  live_bytes -= static_cast<std::ptrdiff_t>(malloc_usable_size(memory));
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) {
  return allocate(size, 1);
}
void* operator new[](std::size_t size) {
  return allocate(size, 1);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
  release(memory);
}
void operator delete[](void* memory) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
  release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
  release(memory);
}

namespace polyhull::test {
namespace {

constexpr int rounds_walked = 24;

/// What one round over the walk allocates, and what is held after it.
struct Round {
  std::size_t allocations;
  std::ptrdiff_t held;
};

/// A figure walks and the same pictures come again every six frames. Memory goes from one
/// camera's cone to another's, so it takes some rounds until each piece has met its largest use.
std::vector<Round> walk(const HullOptions& options, bool cameras_come_and_go) {
  std::vector<HullScene> frames;
  for (int i = 0; i < 6; ++i) frames.push_back(figure_scene(6, 16, 0.1 * i));
  HullBuilder builder;
  std::vector<Round> rounds;
  rounds.reserve(rounds_walked);
  std::vector<std::vector<Silhouette>> views;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    views.push_back(frames[i].views());
    if (cameras_come_and_go) views.back().erase(views.back().begin() + (i % 3));
  }
  for (int round = 0; round < rounds_walked; ++round) {
    const std::size_t before = allocations;
    for (const auto& view : views) EXPECT_FALSE(builder.build(view, options).empty());
    rounds.push_back({allocations - before, live_bytes});
  }
  return rounds;
}

void expect_steady(const char* what, const std::vector<Round>& rounds) {
  std::printf("%s: allocations in six frames", what);
  for (std::size_t i = 0; i < rounds.size(); i += 5) std::printf(" %zu", rounds[i].allocations);
  std::printf("; MB held");
  for (std::size_t i = 0; i < rounds.size(); i += 5)
    std::printf(" %.3f", double(rounds[i].held) / 1e6);
  std::printf("\n");
  const Round& settled = rounds[rounds.size() / 2];
  for (std::size_t i = rounds.size() / 2 + 1; i < rounds.size(); ++i) {
    EXPECT_LE(rounds[i].held, settled.held + settled.held / 100) << what << ", round " << i;
    EXPECT_LE(rounds[i].allocations, settled.allocations + settled.allocations / 50)
        << what << ", round " << i;
  }
}

TEST(HullAllocations, DoNotGrowFromFrameToFrame) {
  HullOptions options;
  expect_steady("exact", walk(options, false));
  expect_steady("exact, cameras come and go", walk(options, true));
  options.max_deviation = 1e-3;
  expect_steady("simplified", walk(options, false));
}

TEST(HullAllocations, DoNotGrowOnTwoThreads) {
  set_pool_threads(2);
  HullOptions options;
  options.threads = 2;
  expect_steady("two threads", walk(options, false));
  set_pool_threads(0);
}

}  // namespace
}  // namespace polyhull::test
