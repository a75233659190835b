// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/thread_pool.h"

#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>

namespace polyhull {
namespace {

using Body = std::function<void(std::size_t, std::size_t)>;

/// One call of parallel_for(): whoever takes part takes piece after piece until none is left. Held
/// by those who are asked to, who may come when it has ended.
class Loop {
 public:
  Loop(std::size_t count, std::size_t grain, const Body& body)
      : count_(count), grain_(grain), body_(body) {}

  void take_part() {
    {
      const std::lock_guard lock(mutex_);
      if (next_ >= count_) return;
      ++inside_;
    }
    std::size_t begin = next_.fetch_add(grain_);
    const bool had_a_piece = begin < count_;
    std::exception_ptr error;
    try {
      for (; begin < count_; begin = next_.fetch_add(grain_))
        body_(begin, std::min(begin + grain_, count_));
    } catch (...) {
      next_ = count_;
      error = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    threads_ += had_a_piece;
    if (error && !error_) error_ = error;
    if (--inside_ == 0) left_.notify_all();
  }

  /// Waits for all who take part; how many did. Throws what a body threw.
  int wait() {
    std::unique_lock lock(mutex_);
    left_.wait(lock, [this] { return inside_ == 0; });
    if (error_) std::rethrow_exception(error_);
    return threads_;
  }

 private:
  const std::size_t count_, grain_;
  const Body& body_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;  // protects the rest
  std::condition_variable left_;
  int inside_ = 0, threads_ = 0;
  std::exception_ptr error_;
};

/// The one arena of all streams' loops: its workers serve whichever loop asks for one. (With an
/// arena for each stream a worker could stay with one that had no loop any more.)
tbb::task_arena& workers() {
  static tbb::task_arena& shared =
      *new tbb::task_arena(std::max(tbb::info::default_concurrency() - 1, 1), 0);
  return shared;
}

std::atomic<int> wanted_threads = 0;
thread_local LoopWatch::Count loops_of_this_thread;

}  // namespace

void set_pool_threads(int threads) {
  wanted_threads = std::max(threads, 0);
}

int pool_threads() {
  // oneTBB has no more workers than cores, and prints a warning where more are asked for.
  const int wanted = wanted_threads, cores = tbb::info::default_concurrency();
  return wanted > 0 ? std::min(wanted, cores) : cores;
}

void parallel_for(std::size_t count, std::size_t grain, int max_threads, const Body& body) {
  if (count == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  if (count <= grain) return body(0, count);
  const int threads = max_threads > 0 ? std::min(pool_threads(), max_threads) : pool_threads();
  LoopWatch::Count& counted = loops_of_this_thread;
  ++counted.loops;
  if (threads <= 1) {
    ++counted.threads;
    return body(0, count);
  }
  const auto loop = std::make_shared<Loop>(count, grain, body);
  for (int i = 1; i < threads; ++i) workers().enqueue([loop] { loop->take_part(); });
  loop->take_part();
  counted.threads += static_cast<std::uint64_t>(loop->wait());
}

LoopWatch::Count LoopWatch::now() {
  return loops_of_this_thread;
}

double LoopWatch::threads() const {
  const Count end = now();
  if (end.loops == begin_.loops) return 1.0;
  return static_cast<double>(end.threads - begin_.threads) /
         static_cast<double>(end.loops - begin_.loops);
}

}  // namespace polyhull
