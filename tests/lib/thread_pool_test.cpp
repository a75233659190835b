// SPDX-License-Identifier: LGPL-2.1-or-later
#include "base/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace polyhull::test {
namespace {

using namespace std::chrono_literals;

/// Back to all cores at the end of a test.
class ThreadPool : public testing::Test {
 protected:
  ~ThreadPool() override { set_pool_threads(0); }
};

/// Runs a loop that no thread can end alone within ten seconds, and says how many took part.
double threads_of_a_long_loop() {
  const LoopWatch watch;
  std::atomic<int> at_work = 0;
  parallel_for(2, 1, 0, [&](std::size_t, std::size_t) {
    ++at_work;
    for (const auto end = std::chrono::steady_clock::now() + 10s;
         at_work < 2 && std::chrono::steady_clock::now() < end;)
      std::this_thread::sleep_for(1ms);
  });
  return watch.threads();
}

TEST_F(ThreadPool, MoreThreadsThanCoresAreNotAskedFor) {
  const int cores = pool_threads();
  set_pool_threads(cores + 100);
  EXPECT_EQ(pool_threads(), cores);
  std::atomic<int> elements = 0;
  parallel_for(1000, 1, 0, [&](std::size_t begin, std::size_t end) {
    elements += static_cast<int>(end - begin);
  });
  EXPECT_EQ(elements, 1000);
}

TEST_F(ThreadPool, CountsTheThreadsThatTookPart) {
  const LoopWatch watch;
  EXPECT_EQ(watch.threads(), 1.0);
  set_pool_threads(1);
  parallel_for(1000, 1, 0, [](std::size_t, std::size_t) {});
  EXPECT_EQ(watch.threads(), 1.0);
  set_pool_threads(2);
  if (pool_threads() < 2) GTEST_SKIP() << "this machine has one core";
  EXPECT_EQ(threads_of_a_long_loop(), 2.0);
  EXPECT_EQ(watch.threads(), 1.5);  // of the two loops
}

TEST_F(ThreadPool, AThreadWithoutLoopsKeepsNoWorker) {
  if (pool_threads() < 2) GTEST_SKIP() << "this machine has one core";
  std::atomic<int> idle = 0;
  std::atomic<bool> ended = false;
  std::vector<std::jthread> streams(3);
  for (std::jthread& stream : streams)
    stream = std::jthread([&] {
      for (int i = 0; i < 20; ++i) parallel_for(8, 1, 0, [](std::size_t, std::size_t) {});
      ++idle;
      ended.wait(false);
    });
  while (idle < 3) std::this_thread::sleep_for(1ms);
  EXPECT_GE(threads_of_a_long_loop(), 2.0);
  ended = true;
  ended.notify_all();
}

TEST_F(ThreadPool, WhatABodyThrowsComesOut) {
  for (int threads : {1, 2}) {
    set_pool_threads(threads);
    EXPECT_THROW(parallel_for(100, 1, 0,
                              [](std::size_t begin, std::size_t end) {
                                if (begin <= 50 && 50 < end) throw std::runtime_error("50");
                              }),
                 std::runtime_error);
    std::atomic<int> elements = 0;
    parallel_for(100, 3, 0, [&](std::size_t begin, std::size_t end) {
      elements += static_cast<int>(end - begin);
    });
    EXPECT_EQ(elements, 100);
  }
}

}  // namespace
}  // namespace polyhull::test
