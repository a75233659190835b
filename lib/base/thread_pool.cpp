// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/thread_pool.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <vector>

namespace polyhull {
namespace {

std::mutex mutex;  // protects wanted_threads
int wanted_threads = 0;

/// The calling thread's own handle onto the process's one set of worker threads. It is kept:
/// workers hardly ever join an arena that is made for one call.
tbb::task_arena& own_arena(int threads) {
  thread_local std::vector<std::unique_ptr<tbb::task_arena>> arenas;
  const std::size_t index = static_cast<std::size_t>(threads);
  if (arenas.size() <= index) arenas.resize(index + 1);
  if (!arenas[index]) arenas[index] = std::make_unique<tbb::task_arena>(threads);
  return *arenas[index];
}

}  // namespace

void set_pool_threads(int threads) {
  std::lock_guard lock(mutex);
  wanted_threads = std::max(threads, 0);
}

int pool_threads() {
  std::lock_guard lock(mutex);
  // oneTBB has no more workers than cores, and prints a warning where more are asked for.
  const int cores = tbb::info::default_concurrency();
  return wanted_threads > 0 ? std::min(wanted_threads, cores) : cores;
}

void parallel_for(std::size_t count, std::size_t grain, int max_threads,
                  const std::function<void(std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  int threads = pool_threads();
  if (max_threads > 0) threads = std::min(threads, max_threads);
  if (threads <= 1 || count <= grain) {
    body(0, count);
    return;
  }
  own_arena(threads).execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, std::max<std::size_t>(grain, 1)),
        [&](const tbb::blocked_range<std::size_t>& range) { body(range.begin(), range.end()); },
        tbb::simple_partitioner());
  });
}

}  // namespace polyhull
