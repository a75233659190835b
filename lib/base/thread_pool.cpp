// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/thread_pool.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace polyhull {
namespace {

using Body = std::function<void(std::size_t, std::size_t)>;

/// One call of parallel_for(): whoever takes part takes piece after piece until none is left.
class Loop {
 public:
  Loop(std::size_t count, std::size_t grain, int workers, const Body& body)
      : places(workers), count_(count), grain_(grain), body_(body) {}

  bool wants_a_worker() const { return places > 0 && next_ < count_; }

  void take_part() {
    std::size_t begin = next_.fetch_add(grain_);
    threads_ += begin < count_;
    try {
      for (; begin < count_; begin = next_.fetch_add(grain_))
        body_(begin, std::min(begin + grain_, count_));
    } catch (...) {
      next_ = count_;
      if (!failed_.exchange(true)) error_ = std::current_exception();
    }
  }

  /// Of these two, once all have left.
  int threads() const { return threads_; }
  const std::exception_ptr& error() const { return error_; }

  // Protected by the pool's mutex:
  int places;      // for more workers
  int inside = 0;  // workers
  std::condition_variable left;

 private:
  const std::size_t count_, grain_;
  const Body& body_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<int> threads_ = 0;  // that had a piece
  std::atomic<bool> failed_ = false;
  std::exception_ptr error_;
};

/// The workers are no stream's own: whichever loop wants one gets one. (oneTBB's belong to the arenas
/// of the threads that start loops, and one could stay with a stream that had none for good.)
class Pool {
 public:
  /// Runs \p loop on the calling thread and the workers that have time.
  void run(Loop& loop) {
    bool wake;
    {
      const std::lock_guard lock(mutex_);
      for (; workers_ < cores() - 1; ++workers_) std::thread([this] { work(); }).detach();
      loops_.push_back(&loop);
      wake = asleep_ > 0;
    }
    // One, which wakes the next: most loops have ended before all of a large machine's would be awake.
    if (wake) wake_.notify_one();
    loop.take_part();
    std::unique_lock lock(mutex_);
    std::erase(loops_, &loop);
    loop.left.wait(lock, [&] { return loop.inside == 0; });
  }

  /// Of the process's, whatever the calling thread is pinned to.
  static int cores() {
    static const int count = [] {
      cpu_set_t set;
      return sched_getaffinity(getpid(), sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    }();
    return count;
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      const auto found = std::find_if(loops_.begin(), loops_.end(),
                                      [](const Loop* loop) { return loop->wants_a_worker(); });
      if (found == loops_.end()) {
        ++asleep_;
        wake_.wait(lock);
        --asleep_;
        continue;
      }
      Loop& loop = **found;
      --loop.places;
      ++loop.inside;
      const bool wake = asleep_ > 0 && loop.wants_a_worker();
      lock.unlock();
      if (wake) wake_.notify_one();
      loop.take_part();
      lock.lock();
      if (--loop.inside == 0) loop.left.notify_one();
    }
  }

  std::mutex mutex_;  // protects all of these
  std::condition_variable wake_;
  std::vector<Loop*> loops_;
  int workers_ = 0, asleep_ = 0;
};

/// Never destroyed: its workers wait for loops until the process ends.
Pool& pool() {
  static Pool& the_pool = *new Pool;
  return the_pool;
}

std::atomic<int> wanted_threads = 0;
thread_local LoopWatch::Count loops_of_this_thread;

}  // namespace

void set_pool_threads(int threads) {
  wanted_threads = std::max(threads, 0);
}

int pool_threads() {
  const int wanted = wanted_threads;
  return wanted > 0 ? std::min(wanted, Pool::cores()) : Pool::cores();
}

void parallel_for(std::size_t count, std::size_t grain, int max_threads, const Body& body) {
  if (count == 0) return;
  if (count <= grain) return body(0, count);
  const int threads = max_threads > 0 ? std::min(pool_threads(), max_threads) : pool_threads();
  LoopWatch::Count& counted = loops_of_this_thread;
  ++counted.loops;
  if (threads <= 1) {
    ++counted.threads;
    return body(0, count);
  }
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t pieces = (count - 1) / grain + 1;
  Loop loop(count, grain, static_cast<int>(std::min<std::size_t>(threads, pieces)) - 1, body);
  pool().run(loop);
  counted.threads += static_cast<std::uint64_t>(loop.threads());
  if (loop.error()) std::rethrow_exception(loop.error());
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
